"""An evaluator of some of the free parameters of another one, with its compiled program."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..._declare.component import Component
from .._compute.evaluator import Evaluator


class PartEvaluator(Evaluator):
    """Evaluates the program of another evaluator with some parameters free. The others keep their values in `model`."""

    def __init__(self, whole: Evaluator, model: Component, names: Sequence[str]) -> None:
        self._columns = [whole.free.names.index(name) for name in names]
        variables = (whole.free.variables[i] for i in self._columns)
        at_model = whole.free.values(model)
        variables = tuple(one._replace(start=at_model[i]) for one, i in zip(variables, self._columns, strict=True))
        super().__init__(model, dataclasses.replace(whole.free, variables=variables), whole.functions)
        self._whole, self._x, self.results = whole, at_model, whole.results

    def _run_at(self, x: np.ndarray) -> Any:
        """The results at values of the free parameters, and the columns of their derivatives."""
        whole = self._x.copy()
        whole[self._columns] = x
        values, jacobian, results = self._whole._run_at(whole)
        self.names, self.owners = self._whole.names, self._whole.owners
        return values, jacobian[:, self._columns], results

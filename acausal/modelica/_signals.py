"""Signals of a run by their Modelica names, which count elements from 1."""

from collections.abc import Callable
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from .._declare.annotations import indices
from .._declare.node import leaves_of
from .._errors import UnknownNameError, suggestion
from .._evaluate.building import system_of
from .._integrate.results.solution import Solution
from ._translate.known import KnownValues
from ._translate.model import ModelicaModel
from ._translate.tree import attribute_path

Reader: TypeAlias = Callable[[Solution], jax.Array]


class ModelicaSignals:
    """The variables, parameters and constants of a model that are numbers, by their Modelica names."""

    def __init__(self, model: ModelicaModel) -> None:
        self._model, self._flat = model, type(model).flat
        self._known = KnownValues(self._flat)
        self._paths = {leaf.path for leaf in leaves_of(model)}

    def __getitem__(self, name: str) -> Reader:
        """A function that reads a variable, or the element of one, from a solution of the model: an array
        [times, *size]. Raises `UnknownNameError` for a name that the model does not have.
        """
        whole, place = self._split(name)
        variable, path = self._flat.variables.get(whole), attribute_path(whole)
        # An input or output of the model is a port, whose variable is `value`.
        own = next((one for one in (path, f"{path}.value") if one in self._paths), None)
        if variable is None or (own is None and whole not in self._known):
            raise UnknownNameError(f"There is no signal {name!r}.{suggestion(name, self._names())}")

        def values(solution: Solution) -> jax.Array:
            found = jnp.asarray(self._known[whole] if own is None else solution[own], float)
            if found.ndim == len(variable.dims):  # a parameter
                found = jnp.broadcast_to(found, (len(solution.ts), *found.shape))
            return found[(..., *place)]

        return values

    def elements(self, name: str) -> list[str]:
        """The names of the elements of an array; other names themselves. Raises `UnknownNameError`."""
        whole, place = self._split(name)
        variable = self._flat.variables.get(whole)
        if variable is None or place:
            return [name]
        return [name + indices(one, counts_from_1=True) for one in np.ndindex(*variable.dims)]

    def states(self) -> list[str]:
        """The states that the text declares."""
        named = {attribute_path(name): name for name in self._flat.variables}
        found: list[str] = []
        for path in system_of(self._model).state_names:
            whole, bracket, index = path.rpartition("[") if path.endswith("]") else (path, "", "")
            name = named.get(whole.removesuffix(".value"))
            found += [] if name is None else [name + bracket + index]
        return found

    def _split(self, name: str) -> tuple[str, tuple[int, ...]]:
        """The variable that a name means, and the place of an element of it, which counts from 0."""
        whole, bracket, _ = name.rpartition("[")
        variable = self._flat.variables.get(whole) if bracket and name not in self._flat.variables else None
        if variable is None:
            return name, ()
        found = dict(zip(self.elements(whole), np.ndindex(*variable.dims), strict=True))
        if name.replace(" ", "") not in found:
            raise UnknownNameError(f"There is no signal {name!r}. {whole} has size {list(variable.dims)}.")
        return whole, found[name.replace(" ", "")]

    def _names(self) -> list[str]:
        return [name for name, variable in self._flat.variables.items() if variable.type != "String"]

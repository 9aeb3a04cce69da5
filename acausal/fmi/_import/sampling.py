"""An FMU for co-simulation as a function of its discrete state and the sample."""

from typing import NamedTuple

import numpy as np

from .description import ImportedVariable, placed, size_of
from .machine import NONE, Machine, Reached


class AfterStep(NamedTuple):
    """Answer of an FMU at the end of a communication step."""

    ends: bool
    outputs: np.ndarray


class SampledFMU(Machine[AfterStep]):
    """The samples of an FMU. A point is an array: the time, the length of the step up to it, and the inputs during the
    step. At the first sample there is no step, and the FMU is initialised.
    """

    kind = "CoSimulation"

    @property
    def n_values(self) -> int:
        """The number of elements of a sample."""
        return 2 + size_of(self.description.outputs)

    def sample(self, number: int, point: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The number of the new discrete state, whether the FMU ends the run, and the outputs."""
        with self._lock:
            new, answer = self._next(number, point, parameters)
            return np.concatenate([[new, answer.ends], answer.outputs])

    def _advance(self, to: Reached, parameters: list[tuple[ImportedVariable, np.ndarray]]) -> AfterStep:
        (time, step), inputs = to.point[:2], to.point[2:]
        instance = self._instance
        if to.before == NONE:
            of_inputs = [(v, inputs[place : place + v.count]) for v, place in placed(self.description.inputs)]
            instance.initialise(time, [*parameters, *of_inputs])
        instance.set(self.description.inputs, inputs)
        ends = to.before != NONE and instance.step(time - step, step)
        return AfterStep(ends, instance.get(self.description.outputs))

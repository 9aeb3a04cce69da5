"""FMUs for co-simulation: they integrate themselves from sample to sample."""

from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
from jax import Array

from ..._declare.annotations import Discrete, Param, Scalar, positive
from ..._declare.component import Equations, Events, at, refuse
from ..._errors import ModelError
from .calls import HostCall, call_of
from .component import ImportedFMU
from .description import placed
from .sampling import SampledFMU


class SampleCalls:
    """The samples of an FMU for co-simulation in JAX. They have no derivatives."""

    def __init__(self, samples: SampledFMU) -> None:
        def refused() -> HostCall:
            raise ModelError(
                f"{samples.path.name} is sampled, and co-simulation has no derivatives. Remedy: import it for model "
                "exchange, without step."
            )

        self.sample = call_of(samples.sample, (samples.n_values,), refused, refused)


class CoSimulation(ImportedFMU, partial=True):
    """An FMU that is sampled at start_time, start_time + step, ...

    At each sample the FMU advances by a step, with the inputs of the sample before. The outputs hold their values until
    the next sample. At the time of a sample, a solution has the outputs before it, as for all events.
    """

    step: Param[Scalar, "s", positive]  # communication step
    start_time: Param[Scalar, "s"] = 0.0  # time of the first sample
    reached: Discrete[Scalar, "1"] = -1.0
    since: Discrete[Scalar, "s"] = 0.0  # time of the last sample

    if TYPE_CHECKING:  # fields of the classes of FMUs that have outputs and inputs
        outputs: Array
        held: Array

    def equations(self, d: Any) -> Equations:
        del d
        return {v.field: self._equals(v, self.outputs, place) for v, place in placed(self._of.outputs)}

    def events(self) -> Events:
        inputs = self._inputs()
        is_first = self.reached < -0.5
        time = jnp.where(is_first, self.t, self.since + self.step)
        during = jnp.where(is_first, inputs, self.held) if self._of.n_inputs else inputs
        point = jnp.concatenate([jnp.stack([time, self.step]), during])
        sample = self._calls.sample(self.reached, point, self._parameters())
        changes = {"reached": sample[0], "ended": sample[1], "since": time}
        if self._of.outputs:
            changes["outputs"] = sample[2:]
        if self._of.n_inputs:
            changes["held"] = inputs
        return {
            "sample": at(self.start_time, every=self.step, check_units=False, **changes),
            "_end": refuse(self.ended > 0.5, f"the FMU {self._key.path.name} ends the simulation"),
        }

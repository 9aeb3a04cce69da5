"""`train`: weights of learned laws that minimise a loss, by the optimisers of optax."""

import dataclasses
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import jax
import numpy as np
from jax import Array
from jaxtyping import Float

from ..._declare.by_name import parameters, refuse_fixed, replace
from ..._declare.component import Component
from ..._errors import (
    DesignWarning,
    ModelError,
    ParameterError,
    SimulationError,
    UnknownNameError,
    reason_of,
    suggestion,
)
from ..._extras import needed
from ..._integrate.setup.options import count
from ..._numbers import Scalar
from ..._progress import compiling, is_read
from .._compute.cores import is_logged
from .._problem.free_parameters import model_or_reason

M = TypeVar("M", bound=Component, covariant=True)
EVERY = 1.0  # s between messages


@dataclasses.dataclass(frozen=True, eq=False)
class Training(Generic[M]):
    """The model of the smallest loss, its `values` by path, and the loss before each step and after the last one.

    If a component refuses the values, there is no model, and `unbuilt` is the reason.
    """

    _model: M | None
    losses: Float[np.ndarray, " steps"]
    values: Mapping[str, Array]
    unbuilt: str = ""

    @property
    def model(self) -> M:
        """The model of the smallest loss. Raises `ParameterError` if it cannot be built."""
        if self._model is None:
            raise ParameterError(f"No model can be built with the trained values: {self.unbuilt}")
        return self._model

    def __str__(self) -> str:
        first, best = self.losses[0], np.min(self.losses)
        return f"loss from {first:.6g} to {best:.6g} in {len(self.losses) - 1} steps"


def train(
    model: M,
    free: Sequence[str],
    loss: Callable[[M], Scalar],
    *,
    steps: int = 100,
    optimiser: Any = None,
    progress: bool | None = None,
) -> Training[M]:
    """Trains parameters of a model, such as the weights of a network, through its simulation.

        def loss(model):
            speeds = simulate(model, times[-1], save=times)["wheel.w"]
            return jnp.mean(((speeds - measured) / 0.1) ** 2)

        found = train(rig, ["friction.network.weights"], loss, steps=100)
        found.model, found.losses

    - `free`: paths of the parameters. The optimiser does not know their ranges or units: scale them to about 1. To
      estimate few physical parameters with intervals, use `identify`.
    - `loss`: a real function of the model that jax can differentiate. It is traced once, so it draws the same random
      numbers in each step.
    - `steps`: number of steps. A keyboard interrupt ends the training with the best model so far.
    - `optimiser`: of optax. The default `optax.lbfgs()` converges fast for a smooth loss; `optax.adam(0.01)` is an
      example of another one.
    - `progress`: whether to print the loss every second; by default on a terminal, and every ten seconds in a log.

    An error after the first step, such as a loss that is not finite, also ends the training with the best model so far,
    and with a `DesignWarning`.

    Raises `UnknownNameError` for an unknown path, `ModelError` without paths or without optax, and `SimulationError` if
    the loss or its gradient is not finite before the first step.
    """
    optax = needed("optax", "learn", "train()")
    optimiser = optax.with_extra_args_support(optax.lbfgs() if optimiser is None else optimiser)
    values, losses = _values(model, free), []

    def of_values(values: dict[str, Array]) -> Scalar:
        return loss(replace(model, values))

    @jax.jit
    def step(values: dict[str, Array], state: Any) -> tuple[Array, dict[str, Array], Any, Array]:
        found, slopes = jax.value_and_grad(of_values)(values)
        updates, state = optimiser.update(slopes, state, values, value=found, grad=slopes, value_fn=of_values)
        return found, optax.apply_updates(values, updates), state, optax.tree.norm(slopes)

    state, best, said = optimiser.init(values), values, time.monotonic()
    try:
        for number in range(count(steps, "steps") + 1):
            with compiling("a training step", model, step, progress is not False):
                found, after, state, slope = step(values, state)
            if not np.isfinite(float(found)) or not np.isfinite(float(slope)):
                raise SimulationError(
                    f"The loss or its gradient is not finite before step {number + 1}. Reduce the learning rate, or "
                    "check that the model can be run with these values and that the loss is smooth there."
                )
            best = values if not losses or float(found) < min(losses) else best
            losses.append(float(found))
            values = after
            waited = time.monotonic() - said
            if waited > EVERY and (is_read(sys.stderr, progress) or is_logged(sys.stderr, progress, waited)):
                said = time.monotonic()
                print(f"step {number}: loss {losses[-1]:.6g}", file=sys.stderr)
    except (KeyboardInterrupt, Exception) as error:
        if not losses:
            raise
        if not isinstance(error, KeyboardInterrupt):
            text = f"The training ended with the best model so far: {reason_of(error)}"
            warnings.warn(text, DesignWarning, stacklevel=2)
    trained, unbuilt = model_or_reason(lambda: replace(model, best))
    return Training(trained, np.array(losses), best, unbuilt)


def _values(model: Component, free: Sequence[str]) -> dict[str, Array]:
    known = parameters(model)
    if isinstance(free, str) or not free:
        raise ModelError(f"train takes a list of paths of parameters, got {free!r}.")
    refuse_fixed(model, free)
    for path in free:
        if path not in known:
            raise UnknownNameError(f"The model has no parameter {path!r}.{suggestion(path, known)}")
    return {path: known[path] for path in free}

"""`hessian`: exact second derivatives of results, checked by differences because a kink has none."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple, overload

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..._analyse.table import aligned
from ..._declare.component import Component
from ..._errors import SimulationError
from ..._integrate.results.failure import trials
from ..._progress import compiling
from ..._units.display import Scale
from .._certificate.second_order import one_sided_derivatives
from .._compute.evaluator import Evaluation, Evaluator
from .._problem.free_parameters import single_parameters
from .._problem.limits import objectives_of
from .._problem.types import Function, One

STEPS = tuple(10.0**-k for k in range(2, 7))  # relative to the sizes of parameters; a large one can reach a kink nearby
APART = 1e-3  # tolerance of exact derivatives against differences, relative to their size and variation
LEAST = 1e-5  # relative accuracy of differences between runs


class Hessian(NamedTuple):
    """Second derivatives of a result with respect to parameters; `print` it.

    `value` is in SI units, `gradient` and `matrix` in SI units per units of the parameters, in the order of `names`.
    """

    result: str
    scale: Scale
    names: tuple[str, ...]
    units: tuple[str, ...]
    value: float
    gradient: Float[np.ndarray, " k"]
    matrix: Float[np.ndarray, "k k"]

    def __str__(self) -> str:
        scales = [Scale.of(unit) for unit in self.units]
        factors = np.array([scale.factor for scale in scales])
        matrix = self.scale.difference(self.matrix) * np.outer(factors, factors)
        rows = [
            [name, scale.unit, *(f"{entry:.6g}" for entry in row)]
            for name, scale, row in zip(self.names, scales, matrix, strict=True)
        ]
        value = f"{self.result} = {self.scale.value(self.value):.6g}{self.scale.text}"
        return f"{value}, second derivatives [{self.scale.unit}]\n{aligned([['', 'per', *self.names], *rows])}"


@overload
def hessian(model: Component, over: Iterable[str], results: One, *, run: Function | None = None) -> Hessian: ...
@overload
def hessian(
    model: Component, over: Iterable[str], results: Mapping[str, One], *, run: Function | None = None
) -> dict[str, Hessian]: ...
def hessian(
    model: Component, over: Iterable[str], results: One | Mapping[str, One], *, run: Function | None = None
) -> Hessian | dict[str, Hessian]:
    """Second derivatives of results with respect to parameters: a `Hessian`, or one by name for several results.

        bent = hessian(drive, ["gear.ratio", "supply.V"], (lambda s: s.t1, "ms"), run=lambda m: simulate(...))
        bent.matrix[0, 1]

    - `over`: paths of parameters, elements of arrays one by one.
    - `results` and `run`: as in `sensitivities`.

    The run is differentiated twice, including its event times. The result is checked against one-sided differences of
    first derivatives over steps of 1 % of a parameter and less, until both agree to 1e-3 of their size and of their
    variation within 2 %.

    Raises `SimulationError` if second derivatives do not exist, such as at the kink of an absolute value or a maximum,
    if they are lost, such as in a piecewise linear table or by `stop_gradient`, and if a result cannot be computed.
    """
    objectives = {objective.name: objective for objective in objectives_of(results, "result")}
    free = single_parameters(model, over, "Second derivatives are by elements of arrays")
    evaluator = Evaluator(model, free, {name: objective.function for name, objective in objectives.items()}, run)
    x = free.values(model)
    second, found = hessians_of(evaluator, x), evaluator(x)
    columns = (evaluator.names, evaluator.owners, found.values.tolist(), found.jacobian, second)
    tables = {
        name: Hessian(name, objectives[owner].scale, free.names, free.units, value, gradient, matrix)
        for name, owner, value, gradient, matrix in zip(*columns, strict=True)
    }
    return tables if isinstance(results, Mapping) else next(iter(tables.values()))


def hessians_of(evaluator: Evaluator, x: Float[np.ndarray, " k"]) -> Float[np.ndarray, "m k k"]:
    """Checked second derivatives of all results at some values."""
    here = evaluator(x)
    if not here.is_good:
        raise SimulationError(f"There are no second derivatives, because there is no result: {here.why}.")

    def results(x: Array) -> Array:
        return evaluator.results(evaluator.free.with_values(evaluator.model, x))[0]

    with trials(), compiling("second derivatives of the results", evaluator.model, results, evaluator.reports):
        second = np.asarray(jax.jit(jax.jacfwd(jax.jacfwd(results)))(jnp.asarray(x)))
    if not np.all(np.isfinite(second)):
        raise SimulationError("The second derivatives of the results are not finite.")
    sizes = _sizes(here, second)
    for i in range(len(x)):
        if message := _disagreement(evaluator, here, second[:, i] * sizes[i] * sizes, i, sizes):
            raise SimulationError(message)
    return second


def _sizes(here: Evaluation, second: np.ndarray) -> np.ndarray:
    """Sizes of the parameters for steps; for a value of zero, the length scale of the results."""
    slopes, bends = np.abs(here.jacobian), np.abs(np.diagonal(second, axis1=1, axis2=2))
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths = np.where(bends > 0.0, slopes / bends, np.abs(here.values)[:, None] / slopes)
    lengths = np.min(np.where(lengths > 0.0, lengths, 1.0), axis=0)
    return np.where(here.x != 0.0, np.abs(here.x), np.minimum(lengths, 1.0))


class _Sides(NamedTuple):
    """One-sided derivatives of results (`slopes`) and gradients (`bends`), and their largest values `slope` and `bend`.

    `why` is the reason if a side could not be computed.
    """

    slopes: list[np.ndarray]
    bends: list[np.ndarray]
    slope: np.ndarray
    bend: np.ndarray
    why: str


def _sides(evaluator: Evaluator, here: Evaluation, i: int, sizes: np.ndarray, step: float) -> _Sides:
    """One-sided differences over steps of the i-th parameter."""
    sides = {k: evaluator(here.x + k * step * sizes * (np.arange(len(sizes)) == i)) for k in (-2, -1, 1, 2)}
    why = next((side.why for side in sides.values() if not side.is_good), "")
    good = {k: side for k, side in sides.items() if side.is_good}
    values = {k: side.values for k, side in good.items()} | {0: here.values}
    slopes = {k: side.jacobian * sizes for k, side in good.items()} | {0: here.jacobian * sizes}
    slope, bend = (
        np.max([np.abs(one - every[0]) for one in every.values()], axis=0) / (2.0 * step) for every in (values, slopes)
    )
    return _Sides(one_sided_derivatives(values, step), one_sided_derivatives(slopes, step), slope, bend, why)


def _disagreement(evaluator: Evaluator, here: Evaluation, second: np.ndarray, i: int, sizes: np.ndarray) -> str:
    """Contradiction between differences over the i-th parameter and its second derivatives; empty if some agree."""
    variable = evaluator.free.variables[i]
    first, where = here.jacobian[:, i] * sizes[i], f"{variable.name} = {variable.text(here.x[i])}"
    wide = _sides(evaluator, here, i, sizes, STEPS[0])
    room = APART * (np.abs(first) + wide.slope) + LEAST * np.abs(here.values)
    known = LEAST * (np.abs(here.jacobian * sizes) + np.abs(here.values)[:, None])
    rooms = APART * (np.abs(second) + wide.bend) + known
    first_message = ""
    for step in STEPS:
        sides = _sides(evaluator, here, i, sizes, step)
        message = f"The second derivatives at {where} cannot be checked, as neither side has a result: {sides.why}."
        if sides.bends:
            pairs = (
                _contradiction([s[row] for s in sides.slopes], first[row], room[row])
                or _contradiction([s[row] for s in sides.bends], second[row], rooms[row])
                for row in range(len(first))
            )
            found = next(((name, one) for name, one in zip(evaluator.names, pairs, strict=True) if one), None)
            if found is None:
                return ""
            message = f"{found[0]} has no second derivatives at {where}: {found[1]}."
        first_message = first_message or message
    return first_message


def _contradiction(sides: list[np.ndarray | float], derivative: np.ndarray | float, room: np.ndarray | float) -> str:
    """Contradiction between one-sided differences and the exact derivative; empty if they agree."""
    if all(np.all(np.abs(side - derivative) <= room) for side in sides):
        return ""
    if np.any(np.abs(sides[0] - sides[-1]) > room):
        return (
            "its one-sided derivatives differ, as at a kink, at an event that only just happens, or in inaccurate runs "
            "(use rtol=1e-9)"
        )
    return (
        "differences on both sides contradict them. The run contains a function that is not smooth, such as a "
        "piecewise linear table, or stop_gradient"
    )

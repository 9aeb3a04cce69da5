"""Trajectories and units of expressions in the variables of a model."""

import functools as ft
from collections.abc import Callable, Sequence

import jax
from jax import Array
from jaxtyping import PyTree

from ..._errors import ModelError, UnitError
from ..._numbers import Numbers
from ..._reduce.flat_model import FlatModel
from ..._reduce.jaxpr import slice_output
from ..._unit_check.interpret import Interpreter, Value, constant
from ..._unit_check.signal_units import unit_of_leaf
from ..._units.dimension import TIME, si_unit_of
from ..._units.parsing import UnknownUnit, parsed
from .user_function import UserFunction, trace


def expression(
    flat: FlatModel, leaves: Sequence[Array], times: tuple[int, ...], function: Callable[..., PyTree]
) -> Array:
    """The trajectory of a scalar function of the variables, evaluated from leaves that hold trajectories."""
    quantity, constants = _traced(function, flat)
    axes = [0 if varies(flat, i) else None for i in quantity.leaves]
    evaluate = lambda *values: quantity(constants, list(values))[0]  # noqa: E731
    many = evaluate if all(axis is None for axis in axes) else jax.vmap(evaluate, in_axes=axes)
    return jax.numpy.broadcast_to(many(*(leaves[i] for i in quantity.leaves)), times)


def varies(flat: FlatModel, leaf: int) -> bool:
    """Whether a leaf has a time axis in a view with trajectories."""
    return flat.leaves[leaf].declaration.role != "param" or flat.leaves[leaf].stack != ()


def _traced(
    function: Callable[..., PyTree], flat: FlatModel, what: str = "An expression"
) -> tuple[UserFunction, list[Numbers]]:
    quantity, constants = trace(function, flat, what)
    if quantity.n_outputs != 1:
        raise ModelError(f"{what} must be one real number, but this one returned {quantity.n_outputs}.")
    return quantity, constants


def unit_of_expression(function: Callable[..., PyTree], flat: FlatModel, what: str = "An expression") -> str:
    """The SI unit of a function of the variables, or "" if the unit cannot be inferred. `what` names it in errors."""
    quantity, constants = _traced(function, flat, what)
    units = [unit_of_leaf(flat, i) for i in quantity.leaves]
    interpreter = Interpreter()
    (result,) = interpreter.interpret(
        quantity.closed, [constant(c) for c in constants] + [_value(unit) for unit in units]
    )
    if interpreter.problems or result.dimension is None:
        return ""
    # A dimension may have several units, such as rad/s and 1/s. The result takes the unit of the variables in the
    # expression. If these have several units of this dimension, or none, it takes the name of the dimension.
    same = {unit for unit in units if unit and parsed(unit).dimension == result.dimension}
    return same.pop() if len(same) == 1 else si_unit_of(result.dimension)


@ft.lru_cache(maxsize=512)
def check_units_of(quantity: UserFunction, flat: FlatModel, what: str, outputs: tuple[int, ...] = (0,)) -> None:
    """Raise `UnitError` if some outputs of a function add or compare variables of different units.

    Numbers of the function fit any unit. Leaves of a second view are derivatives by time.
    """
    n_constants = len(quantity.closed.in_avals) - len(quantity.leaves)
    inputs = [Value(None, "number")] * n_constants + [_leaf_value(flat, i) for i in quantity.leaves]
    problems: list[str] = []
    for output in outputs:
        part, used = slice_output(quantity.closed, output)
        interpreter = Interpreter(any_constant=True)
        interpreter.interpret(part, [inputs[i] for i in used])
        problems += interpreter.problems
    if problems:
        listed = "; ".join(dict.fromkeys(problems))
        raise UnitError(f"The units in {what} do not agree: it {listed}. Remedy: compare quantities of one unit.")


def _leaf_value(flat: FlatModel, number: int) -> Value:
    """A leaf as a value in a message."""
    order, leaf = divmod(number, len(flat.own_leaves))
    unit, path = unit_of_leaf(flat, leaf), flat.leaves[leaf].path
    try:
        dimension = parsed(unit).dimension if unit else None
    except UnknownUnit:
        dimension = None
    if order == 0:
        return Value(dimension, f"s.{path}", unit=unit or None)
    return Value(None if dimension is None else dimension / TIME, f"d.{path}")


def _value(unit: str) -> Value:
    return Value(parsed(unit).dimension if unit else None, "", unit=unit or None)


def shown_unit(unit: str, wanted: Sequence[str]) -> str:
    """The first of the wanted units that is convertible from `unit`, otherwise `unit` itself.

    Raises `ModelError` for an unknown wanted unit.
    """
    try:
        kinds = {_measured(other): other for other in reversed(wanted)}
    except UnknownUnit as error:
        raise ModelError(f"units: {error}") from error
    try:
        return kinds.get(_measured(unit), unit)
    except UnknownUnit:  # no unit, or one with roots
        return unit


def _measured(unit: str) -> tuple[object, ...]:
    """The properties that must agree between two units for a conversion."""
    found = parsed(unit)
    return found.dimension, found.has_angle, found.counts

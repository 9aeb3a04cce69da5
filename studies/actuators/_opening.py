"""How long an actuator takes to open the clutch."""

from typing import Any

from acausal import Scalar, Solution, simulate

from ._models import ClutchActuator

STROKE = 12e-3  # m, travel of the slave at which the clutch is open
WORN_LOAD = 800.0  # N at the slave with the clutch open, with limited wear, as the thesis states it
LONGEST = 5.0  # s, given up after this time: the slowest design that opens is the present one, in 0.4 s


def opening(
    model: ClutchActuator,
    *,
    stroke: Scalar = STROKE,
    rtol: Scalar = 1e-9,
    t_max: Scalar = LONGEST,
    save: object = "steps",
    throw: bool = False,
    **options: Any,
) -> Solution:
    """The run from rest until the slave has travelled `stroke` in m, of `t_max` in s at most.

    Nothing is raised for a design that does not get there: `t1` of the solution is infinite and `result` says why;
    unless `throw` asks for it. Other `options` are those of `simulate`.
    """
    return simulate(model, t_max, until=lambda s: s.slave.rod.s - stroke, save=save, rtol=rtol, throw=throw, **options)


def opening_time(
    model: ClutchActuator, *, stroke: Scalar = STROKE, rtol: Scalar = 1e-9, t_max: Scalar = LONGEST
) -> Scalar:
    """The time in s after which the slave has travelled `stroke` in m; infinite if that takes more than `t_max` in s.

    Differentiable in both modes, and goes under `jit` and `vmap`. An infinite time has a derivative of zero; the
    reason for it is `opening(model).result`.
    """
    return opening(model, stroke=stroke, rtol=rtol, t_max=t_max, save="end").t1

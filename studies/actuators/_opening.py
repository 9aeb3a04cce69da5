"""Opening time of an actuator."""

from typing import Any

from acausal import Scalar, Solution, simulate

from ._models import ClutchActuator

STROKE = 12e-3  # m, travel of the slave at which the clutch is open
WORN_LOAD = 800.0  # N, load at the slave of the open clutch with limited wear, stated in the thesis
LONGEST = 5.0  # s, limit of a run; the slowest design that opens is the present one, in 0.4 s


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
    """Simulates from rest until the slave has travelled `stroke` in m, or until `t_max` in s.

    If the clutch does not open, `t1` of the solution is infinite and `result` states the reason; `throw=True` raises
    an error instead. Other `options` are those of `simulate`.
    """
    return simulate(model, t_max, until=lambda s: s.slave.rod.s - stroke, save=save, rtol=rtol, throw=throw, **options)


def opening_time(
    model: ClutchActuator, *, stroke: Scalar = STROKE, rtol: Scalar = 1e-9, t_max: Scalar = LONGEST
) -> Scalar:
    """The time in s after which the slave has travelled `stroke` in m; infinite if it exceeds `t_max` in s.

    Differentiable in both modes, and works under `jit` and `vmap`. An infinite time has a zero derivative;
    `opening(model).result` states its reason.
    """
    return opening(model, stroke=stroke, rtol=rtol, t_max=t_max, save="end").t1

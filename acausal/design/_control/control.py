"""`control`: signals that drive a model to a target in the least time or at the least cost."""

import dataclasses
import functools as ft
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.by_name import replace
from ..._declare.component import Component
from ..._declare.node import leaves_of
from ..._errors import ModelError, ParameterError
from ..._integrate.setup.options import count, flag
from ..._integrate.simulate import simulate
from ..._numbers import Numbers
from .._optimise.optimise import optimise
from .._optimise.solve import Method
from .._problem.free_parameters import free_parameters
from .._problem.limits import Objective, limits_of, objectives_of
from .._problem.types import ByPath, Function, Key, number_in
from .course import GAPS, LEAST_WHOLE, PLANT, WHOLE, Course, course_of
from .horizon import Horizon, Runs, Shooting, nodes_of

M = TypeVar("M", bound=Component)
LEAST = 1e-3  # smallest interval relative to the largest duration, if the times of samples are free


def control(
    model: M,
    signals: Mapping[str, object],
    duration: object,
    minimise: object = None,
    *,
    end: Mapping[str, Any] | None = None,
    path: Mapping[str, Any] | None = None,
    free: ByPath[object] | None = None,
    segments: int = 1,
    switching: bool = False,
    guess: Mapping[str, object] | None = None,
    rtol: float = 1e-9,
    options: Mapping[str, Any] | None = None,
    method: Method = "SLSQP",
    most: int = 200,
    sensitivities: bool = True,
    progress: bool | None = None,
) -> Course[M]:
    """Finds the signals that drive a model to a target in the least time or at the least cost.

        control(
            cart,
            {"command": ("-10 N", "10 N")},
            ("0.1 s", "5 s"),
            end={"place": (lambda s: s.mass.a.s, "== 0.8 m"), "rest": (lambda s: s.mass.v, "== 0 m/s")},
            path={"speed": (lambda s: s.mass.v, "<= 1.2 m/s")},
        )

    - `signals`: bounds of the samples by the path of a component with `times` and `values`, such as `TimeSeries` or
      `Staircase`. All signals get the same times, with the relative intervals of the first one. The search starts from
      the samples in the model.
    - `duration`: the duration, or bounds for it. The search starts from the duration of the signals.
    - `minimise`: a rate with a name, whose integral is minimised, with the unit of the integral unless it is a pure
      number, as in `{"loss": (lambda s: s.motor.resistor.R * s.motor.p.i**2, "J")}`; by default the duration.
    - `end`: functions of the final variables with their limits, as in `optimise`.
    - `path`: functions of the variables with limits that hold at all times: their peaks between samples are limited.
    - `free`: further free parameters with their bounds, as in `optimise`.
    - `segments`: number of segments of multiple shooting, for unstable or long motions. The states between segments are
      free, and continuity is a constraint. With segments or path limits, the horizon is run piece by piece, and each
      piece starts in the modes implied by its initial states.
    - `switching`: whether the times of the samples are also free.
    - `guess`: evenly spaced start values of states over the horizon, by name, for segments. Other states start from a
      run with the signals in the model.
    - `rtol` and other `options` are those of `simulate`; `method`, `most`, `sensitivities` and `progress` those of
      `optimise`.

    Raises `ModelError` for an invalid problem, `ParameterError` for bounds and units, and `SimulationError` if no
    motion can be computed.
    """
    low, high, times = _times(model, signals, duration)
    is_free, intervals = low < high, len(times) - 1
    objective = _objective(minimise, is_free)
    _check_limits(path or {}, end or {})
    if intervals % count(segments, "segments"):
        raise ModelError(f"{intervals} intervals cannot be divided into {segments} equal segments.")
    run = _run(path or {}, minimise, {"rtol": rtol, **(options or {})})
    pieces = intervals // segments if path else 1
    shooting = Shooting(tuple(signals), segments, pieces, flag(switching, "switching"), run)
    horizon = Horizon(plant=model, duration=times[-1], intervals=np.diff(times), nodes=np.zeros(0))
    if segments > 1 or path:
        nodes = nodes_of(shooting.model(horizon), run, times[:: intervals // segments], guess or {})
        shooting = dataclasses.replace(shooting, nodes=nodes)
        horizon = replace(horizon, {"nodes": np.zeros(nodes.guess.size)})
    found = optimise(
        horizon,
        _free(model, signals, free or {}, shooting, (low, high)),
        {objective.name: (_duration if minimise is None else _cost, objective.scale.shown)},
        run=shooting,
        constraints=_constraints(path or {}, end or {}, shooting, (low, high)),
        method=method,
        most=most,
        sensitivities=sensitivities,
        progress=progress,
    )
    return course_of(found, shooting)


def _times(model: Component, signals: Mapping[str, object], duration: object) -> tuple[float, float, np.ndarray]:
    """Bounds of the duration, and the initial times of the samples."""
    if not isinstance(model, Component):
        raise ModelError(f"{model!r} is not a component. Give a model to control.")
    if not isinstance(signals, Mapping) or not signals:
        raise ModelError(f"Name at least one signal, as in {{'command': ('-10 N', '10 N')}}; got {signals!r}.")
    bounds = duration if isinstance(duration, tuple | list) else (duration, duration)
    if len(bounds) != 2:
        raise ParameterError(f"duration must be a time or a pair of bounds; got {duration!r}.")
    low, high = (number_in(bound, "s", "duration")[0] for bound in bounds)
    if not 0.0 < low <= high < np.inf:
        raise ParameterError(f"duration must be positive and finite, the lower bound first; got {duration!r}.")
    leaves = {leaf.path: leaf.value for leaf in leaves_of(model)}
    for name in signals:
        if f"{name}.times" not in leaves or f"{name}.values" not in leaves:
            raise ModelError(f"{name} has no times and values. Give the path of a signal, such as a TimeSeries.")
    samples = [np.asarray(leaves[f"{name}.times"], float) for name in signals]
    if len({len(each) for each in samples}) > 1:
        raise ModelError(f"Signals share their times, but {', '.join(signals)} have different numbers of them.")
    times = samples[0] - samples[0][0]
    first = times[-1] if low <= times[-1] <= high else 0.5 * (low + high)
    return low, high, times * first / times[-1]


def _objective(minimise: object, is_free: bool) -> Objective:
    """The objective: the duration, or an integral with its rate as the function."""
    if minimise is None and not is_free:
        raise ModelError("There is nothing to minimise: give bounds for the duration, or a rate as `minimise`.")
    objective, *more = objectives_of({"duration": (len, "s")} if minimise is None else minimise, "cost")
    if more:
        raise ModelError("control minimises one integral.")
    return objective


def _check_limits(path: Mapping[str, Any], end: Mapping[str, Any]) -> None:
    for _, limit in limits_of(path).values():
        if limit.is_equation:
            raise ModelError(f"{limit.name}: a path limit must be '<=' or '>='. Use `end` for an equation at the end.")
    for name in limits_of(end):
        if name in path:
            raise ModelError(f"{name} is the name of a limit at the end and of a path limit. Rename one.")


def _run(path: Mapping[str, Any], minimise: object, options: Mapping[str, Any]) -> Callable[..., Any]:
    """The run of a model between two times, with its cost and the limited peaks."""
    asked: dict[str, Any] = {"save": "end"}
    if minimise is not None:
        asked["integrals"] = lambda s: _objective(minimise, True).function(s)
    if path:
        signs = {name: limit.sign for name, (_, limit) in limits_of(path).items()}
        asked["peaks"] = lambda s: {name: sign * path[name][0](s) for name, sign in signs.items()}

    def run(model: Any, t0: Numbers, t1: Numbers, **others: Any) -> Any:
        return simulate(model, t1, t0=t0, **{**asked, **options, **others})

    return run


def _free(
    model: Component,
    signals: Mapping[str, object],
    free: ByPath[object],
    shooting: Shooting,
    within: tuple[float, float],
) -> dict[Key, object]:
    """The free parameters of the horizon."""
    mine = {f"{name}.values": bounds for name, bounds in signals.items()} | dict(free)
    free_parameters(model, mine)  # raises errors with the names that the user gave
    found: dict[Key, object] = {}
    for key, bounds in mine.items():
        found[tuple(PLANT + path for path in key) if isinstance(key, tuple) else PLANT + key] = bounds
    low, high = within
    if shooting.switching:
        found["intervals"] = (LEAST * high, high)
    elif low < high:
        found["duration"] = within
    if shooting.segments > 1:
        found["nodes"] = None
    return found


def _constraints(
    path: Mapping[str, Any], end: Mapping[str, Any], shooting: Shooting, within: tuple[float, float]
) -> dict[str, Any]:
    found: dict[str, Any] = {name: (ft.partial(_at_end, function), limit) for name, (function, limit) in end.items()}
    for name, (_, limit) in limits_of(path).items():
        found[name] = (ft.partial(_peak, name, limit.sign), path[name][1])
    low, high = within
    if shooting.switching and low == high:
        found[WHOLE] = (_duration, f"== {low} s")
    elif shooting.switching:
        found |= {WHOLE: (_duration, f"<= {high} s"), LEAST_WHOLE: (_duration, f">= {low} s")}
    if shooting.segments > 1:
        found[GAPS] = (lambda runs: runs.gaps, "== 0")
    return found


def _duration(runs: Runs) -> Array:
    return runs.duration


def _cost(runs: Runs) -> Array:
    return jnp.sum(runs.solution.integrals[..., -1])


def _at_end(function: Function, runs: Runs) -> Any:
    last = runs.solution.final
    return function(jax.tree_util.tree_map(lambda x: x[-1], last) if runs.solution.is_batched else last)


def _peak(name: str, sign: float, runs: Runs) -> Any:
    return sign * runs.solution.peaks[name].value

"""Optimal ratio, displacement or other sizes of an actuator within limits, with a certificate."""

import functools as ft
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import jax.numpy as jnp

from acausal import ArgumentError, Scalar, Solution
from acausal.design import Design, optimise
from components.rotational import PlanetaryGearbox

from ._conditions import at_temperature
from ._models import CamActuator, ClutchActuator, PumpActuator
from ._opening import opening
from ._statics import WORN, hold, lift_share, pressure_angle
from ._warm import SHEETS

Peak = Callable[[Any], Scalar]
Read = Callable[[Solution], Scalar]
PEAKS: Mapping[str, Peak] = MappingProxyType(
    {
        "peak current": lambda s: s.motor.p.i,
        "line pressure": lambda s: s.line.p,
        "motor speed": lambda s: s.motor.rotor.w,
        "gear torque": lambda s: s.cam.shaft.tau,
    }
)
# Results of a run by name, with their display units. Results of the hold neglect friction and gear losses.
RESULTS: Mapping[str, tuple[Read, str]] = MappingProxyType(
    {
        "opening time": (lambda s: s.t1, "ms"),
        "peak current": (lambda s: s.peaks["peak current"].value, "A"),
        "line pressure": (lambda s: s.peaks["line pressure"].value, "bar"),
        "motor speed": (lambda s: s.peaks["motor speed"].value, "rpm"),
        "gear torque": (lambda s: s.peaks["gear torque"].value, "N.m"),
        "holding current": (lambda s: hold(s.final).current, "A"),
        "holding power": (lambda s: hold(s.final).power, "W"),
        "pressure angle": (lambda s: pressure_angle(s.final), "deg"),
        "lift for a worn clutch": (lambda s: lift_share(s.final, WORN), "1"),
    }
)
LATEST = 1.0  # s, limit of a run


def optimum(
    model: ClutchActuator,
    free: Mapping[Any, Any] | None = None,
    *,
    minimise: str = "opening time",
    limits: Mapping[str, str] | None = None,
    temperatures: Sequence[float] = (),
    rtol: float = 1e-9,
    **options: Any,
) -> Design[Any]:
    """Minimises one of `RESULTS` over sizes of an actuator, subject to limits on others.

        optimum(electromechanical("FISE", 12.0), limits={"peak current": "<= 70 A", "holding current": "<= 20 A"})

    - `free`: bounds by path. The default is the ratio of the gearhead or the displacement of the pump, from a fifth of
      to five times its value.
    - `minimise`: a name in `RESULTS`; `limits`: limits of others, as strings.
    - `temperatures`: in C. The limits hold at each of them; the objective is the result at the first one. The
      parameters of the model are those at 25 C, like those of data sheets.

    Other `options` are those of `acausal.design.optimise`. Raises `ArgumentError` for an unknown name, and for a gear
    train without `free`, because its ratio is divided among several stages.
    """
    limits = dict(limits or {})
    for name in (minimise, *limits):
        if name not in RESULTS:
            raise ArgumentError(f"optimum has no result {name!r}. The results are {', '.join(RESULTS)}.")
    wanted = {name: PEAKS[name] for name in (minimise, *limits) if name in PEAKS}
    run = ft.partial(_runs, wanted=wanted, temperatures=tuple(temperatures) or (SHEETS - 273.15,), rtol=rtol)
    read, unit = RESULTS[minimise]
    return optimise(
        model,
        _free(model) if free is None else free,
        {minimise: (lambda runs: read(runs[0]), unit)},
        run=run,
        constraints={name: (ft.partial(_at_each, RESULTS[name][0]), text) for name, text in limits.items()},
        **options,
    )


def _runs(model: Any, wanted: Mapping[str, Peak], temperatures: Sequence[float], rtol: float) -> tuple[Solution, ...]:
    """The opening at each temperature."""

    def peaks(s: Any) -> dict[str, Scalar]:
        return {name: read(s) for name, read in wanted.items()}

    return tuple(
        opening(
            at_temperature(model, celsius), t_max=LATEST, save="end", rtol=rtol, throw=True,
            peaks=peaks if wanted else None,
        )
        for celsius in temperatures
    )  # fmt: skip


def _at_each(read: Read, runs: Sequence[Solution]) -> Any:
    return jnp.stack([jnp.asarray(read(one)) for one in runs]) if len(runs) > 1 else read(runs[0])


def _free(model: ClutchActuator) -> dict[str, tuple[float, float]]:
    if isinstance(model, PumpActuator):
        size, path, least = model.pump.displacement, "pump.displacement", 0.0
    elif isinstance(model, CamActuator) and isinstance(model.gearbox, PlanetaryGearbox):
        size, path, least = model.gearbox.ratio, "gearbox.ratio", 1.05
    else:
        raise ArgumentError(
            f"optimum has no default for the free sizes of {type(model).__name__}. Give `free`, bounds by path. To "
            "optimise the ratio of a gear train, use a single ratio as the gearhead."
        )
    return {path: (max(0.2 * float(size), least), 5.0 * float(size))}

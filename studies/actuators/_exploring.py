"""An actuator with sliders."""

import functools as ft
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from acausal import ArgumentError, Scalar, Solution, parameters
from acausal.design import Explorer, explore

from ._conditions import at_temperature
from ._models import CamActuator, ClutchActuator
from ._opening import opening
from ._optimum import LATEST, PEAKS, RESULTS
from ._use import energies_of, powers

# Parameters with sliders, if the actuator has them. The search for an optimum varies the sizes and keeps the others.
SIZES = ("gearbox.ratio", "pump.displacement", "master.bore", "slave.bore", "cam.profile.eccentricity")
OTHERS = (
    "cam.profile.radius", "supply.V", "motor.resistor.R", "motor.emf.k", "motor.rotor.J", "motor.bearing.C",
    "clutch.rate",
)  # fmt: skip
RANGE = 2.5  # the sliders reach from the value divided by this factor to the value multiplied by it
LIMITS: Mapping[str, str] = MappingProxyType(
    {
        "peak current": "<= 70 A", "line pressure": "<= 40 bar", "holding current": "<= 20 A",
        "motor speed": "<= 6000 rpm",
    }
)  # fmt: skip  # targets of the thesis
OF_DISCS = ("pressure angle", "lift for a worn clutch")  # results of actuators with an eccentric disc
CURVES = {
    "stroke": "slave.rod.s", "line pressure": "line.p", "motor current": "motor.p.i", "motor speed": "motor.rotor.w",
}  # fmt: skip
HOLD = 10.0  # s
ENERGIES: Mapping[str, Any] = MappingProxyType(
    {
        "energy of the battery": (lambda s: energies_of(s, HOLD).battery, "J"),
        "heat of the winding": (lambda s: energies_of(s, HOLD).winding, "J"),
        "energy of the clutch": (lambda s: energies_of(s, HOLD).clutch, "J"),
        "hold for 10 s": (lambda s: energies_of(s, HOLD).holding, "J"),
    }
)


def explorer(
    model: ClutchActuator,
    free: Mapping[Any, Any] | None = None,
    *,
    minimise: str = "opening time",
    limits: Mapping[str, str] | None = None,
    temperatures: Sequence[float] = (),
    rtol: float = 1e-6,
) -> Explorer[Any]:
    """An actuator with sliders: results, energies, limits, gradients and curves of its opening.

        explorer(electromechanical("FISE", 12.0)).app()

    - `free`: bounds by path. By default, those of `SIZES` and `OTHERS` that the actuator has. The search for an optimum
      keeps `OTHERS`, unless the app or the call frees them.
    - `limits`: limits of `RESULTS`, by default those in `LIMITS`. `minimise`: the first result of the others.
    - `temperatures`: a single one in C. The parameters of the model are those at 25 C.

    Raises `ArgumentError` for an unknown result and for several temperatures.
    """
    limits = dict(LIMITS if limits is None else limits)
    for name in (minimise, *limits):
        if name not in RESULTS:
            raise ArgumentError(f"explorer has no result {name!r}. The results are {', '.join(RESULTS)}.")
    if len(temperatures) > 1:
        raise ArgumentError(f"explorer takes one temperature, got {', '.join(map(str, temperatures))}.")
    names = [name for name in RESULTS if isinstance(model, CamActuator) or name not in ("gear torque", *OF_DISCS)]
    shown = [minimise, *(name for name in names if name not in (minimise, *limits))]
    found = _around(model) if free is None else dict(free)
    return explore(
        model,
        found,
        {name: RESULTS[name] for name in shown} | dict(ENERGIES),
        run=ft.partial(
            _run,
            temperatures=tuple(temperatures),
            peaks=tuple(name for name in (*shown, *limits) if name in PEAKS),
            rtol=rtol,
        ),
        constraints={name: (RESULTS[name][0], text) for name, text in limits.items()},
        curves=[CURVES],
        units=("mm", "bar", "rpm"),
        held=[path for path in found if path in OTHERS] if free is None else (),
    )


def _run(model: Any, save: str, *, temperatures: Sequence[float], peaks: Sequence[str], rtol: float) -> Solution:
    """The opening; its curves need neither peaks nor integrals."""

    def largest(s: Any) -> dict[str, Scalar]:
        return {name: PEAKS[name](s) for name in peaks}

    for celsius in temperatures:
        model = at_temperature(model, celsius)
    read: dict[str, Any] = {"integrals": powers, "peaks": largest} if save == "end" else {}
    return opening(model, t_max=LATEST, save=save, rtol=rtol, throw=True, **read)


def _around(model: ClutchActuator) -> dict[str, tuple[float, float]]:
    """Bounds around the values of the parameters with sliders."""
    known = {path: float(value) for path, value in parameters(model).items() if path in (*SIZES, *OTHERS)}
    return {path: (known[path] / RANGE, known[path] * RANGE) for path in (*SIZES, *OTHERS) if path in known}

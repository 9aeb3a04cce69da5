"""Choice of parts for the shortest opening time: 10,000 combinations of products, and the continuous optimum.

There is one table per part and one batch per structure: a cam behind one gearhead or two in series, or a pump. Motor
data come from data sheets, with leads of 0.1 ohm. Friction and all other parameters are those of the actuators.
"""

import dataclasses
import functools as ft
import itertools
import math
import time
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from acausal import Scalar, Solution, quantity
from acausal.design import Choice, Design, choose
from components.catalogues import DataSheet, catalogue

from ._output import print_table, require_matplotlib, write_json
from .actuators import WORN, ClutchActuator, ehs_maxon, ema_maxon, holding_current, lift_share, pressure_angle
from .actuators import opening as run_until_open

LEADS = 0.1  # ohm, assumed, between battery and motor
RTOL = 1e-7  # of the runs of products, whose data have three digits
LONGEST = 0.15  # s, limit of the opening time, where a run stops
FAILURES = {"never_stopped": f"opening time <= {1e3 * LONGEST:g} ms"}
LARGEST = 40.0  # largest ratio; no motor is fast enough for more
INCH = 25.4  # mm
FREE = ("gearbox.ratio", "master.bore", "slave.bore", "cam.profile.eccentricity")
HOLDING = "holding current of the motor"  # a limit
# Opening time in s and holding current in A of the prototypes in the thesis.
MEASURED = {"RE 50 with cam": (0.070, 23.0), "RE 40 with pump": (0.130, 19.0)}
# Order names of the candidate parts, a subset of the catalogues that limits the number of combinations.
STUDIED = {
    "motors": ("148867", "370354", "118752", "268214", "RE 35 30 V"),
    "gearheads": ("203115", "GP 52 C 4.3:1", "166167", "166936", "144043"),
    "pumps": ("0.5 D 1.60",),
}
HEADS = ("", "opening time [ms]", "holding current [A]", "design")


def bores(path: str, least: int, largest: int) -> list[dict[str, Any]]:
    """Standard bores of cylinders, in sixteenths of an inch."""
    return [{"name": f"{n}/16 in", path: quantity(n / 16 * INCH, "mm")} for n in range(least, largest + 1)]


def sheets(name: str) -> list[DataSheet]:
    """The data sheets of the candidates in a catalogue."""
    table = catalogue(name)
    return [table[order] for order in STUDIED[name]]


MOTORS = [
    {
        "name": f"{sheet.family} {sheet['nominal_voltage']:g} V", "motor.resistor.R": sheet["resistance"] + LEADS,
        "motor.emf.k": sheet["torque_constant"], "motor.rotor.J": sheet["inertia"],
    }
    for sheet in sheets("motors")
]  # fmt: skip
GEARHEADS = [
    {
        "name": " + ".join(f"{sheet['ratio']:g}:1" for sheet in heads),
        "gearbox.ratio": math.prod(sheet["ratio"] for sheet in heads),
        "figures": {"speed": heads[0].get("max_input_speed") or math.inf},
    }
    for number in (1, 2) for heads in itertools.combinations_with_replacement(sheets("gearheads"), number)
    if math.prod(sheet["ratio"] for sheet in heads) <= LARGEST
]  # fmt: skip
PUMPS = [
    {
        "name": sheet.order, "pump.displacement": sheet["displacement"],
        "figures": {"speed": sheet.get("max_speed") or math.inf, "pressure": sheet.get("max_pressure") or math.inf},
    }
    for sheet in sheets("pumps")
]  # fmt: skip
TABLES: Mapping[str, Mapping[str, list[dict[str, Any]]]] = {
    "cam": {
        "motor": MOTORS,
        "gearhead": GEARHEADS,
        "master": bores("master.bore", 10, 16),
        "slave": bores("slave.bore", 9, 15),
        "eccentricity": [
            {"name": f"{n / 2:g} mm", "cam.profile.eccentricity": quantity(n / 2, "mm")} for n in range(8, 19)
        ],
    },
    "pump": {"motor": MOTORS, "pump": PUMPS, "slave": bores("slave.bore", 9, 15)},
}


def has_cam(s: Solution) -> bool:
    return hasattr(s.final, "cam")


def current(s: Solution) -> Scalar:
    """The holding current in A, without friction."""
    return holding_current(s.final)


def speed(s: Solution, parts: Mapping[str, Mapping[str, float]]) -> Scalar:
    """The speed of the motor, relative to the rated speed of the gearhead or the pump."""
    return s.peaks["speed"].value / parts["gearhead" if has_cam(s) else "pump"]["speed"]


def pressure(s: Solution, parts: Mapping[str, Mapping[str, float]]) -> Scalar:
    """The pressure of the pump, relative to its rated pressure."""
    return 0.0 if has_cam(s) else s.final.line.p / parts["pump"]["pressure"]


def worn_lift(s: Solution) -> Scalar:
    """The share of the cam's lift that a worn clutch needs."""
    return lift_share(s.final, WORN) if has_cam(s) else 0.0


def angle(s: Solution) -> Scalar:
    """The largest pressure angle of a cam, in rad."""
    return pressure_angle(s.final) if has_cam(s) else 0.0


MINIMISE = {"opening time": (lambda s: s.t1, "ms"), "holding current": (current, "A")}
LIMITS = {
    "peak current": (lambda s: s.final.supply.V / s.final.motor.resistor.R, "<= 70 A"),
    HOLDING: (current, "<= 20 A"),
    "line pressure": (lambda s: s.final.line.p, "<= 40 bar"),
    "rated speed": (speed, "<= 1"),
    "rated pressure": (pressure, "<= 1"),
    "pressure angle": (angle, "<= 30 deg"),
    "lift, worn clutch": (worn_lift, "<= 1"),
}


@dataclasses.dataclass(frozen=True)
class Row:
    """Summary of the choice, in SI units."""

    combinations: int
    feasible: int
    seconds: float
    best: Mapping[str, Any]
    continuous_optimum: Mapping[str, Any]


def opening(model: ClutchActuator, rtol: float) -> Solution:
    """The run until the clutch is open, with the peak speed of the motor."""
    return run_until_open(model, t_max=LONGEST, save="end", rtol=rtol, peaks=lambda s: {"speed": s.motor.rotor.w})


def study(tables: Mapping[str, Any] = TABLES, store: Path | None = None) -> Choice:
    """Evaluates all combinations of the tables. With a `store`, an interrupted study can be resumed."""
    models = {"cam": ema_maxon(), "pump": ehs_maxon()}
    run = ft.partial(opening, rtol=RTOL)
    return choose(models, tables, MINIMISE, run=run, constraints=LIMITS, failures=FAILURES, store=store)


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Choose, print, and write rows to the file `json`, pictures and a report to the folder `out`.

    The folder also stores the results of the products, so that an interrupted study can be resumed.
    """
    if out is not None:
        require_matplotlib()
    began = time.perf_counter()
    choice = study(store=None if out is None or find_spec("zarr") is None else out / "catalogue")
    seconds = time.perf_counter() - began
    design = choice.continuous(*FREE, run=ft.partial(opening, rtol=rtol))
    rows = [_row(choice, design, seconds)]
    print(f"{choice}\n\n{design}\n")
    print_table("Best combinations of products and the continuous optimum", HEADS, _cells(choice, design))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(choice, design, out)
    return rows


def _row(choice: Choice, design: Design, seconds: float) -> Row:
    assert choice.best is not None
    values = dict(zip(MINIMISE, choice.values[choice.best].tolist(), strict=True))
    best = {**choice.combination(choice.best), **values}
    optimum = {**design.values, "opening time": design.objective, "kkt_residual": design.kkt_residual}
    return Row(len(choice.codes), int(choice.is_feasible.sum()), seconds, best, optimum)


def _cells(choice: Choice, design: Design) -> list[Sequence[str]]:
    """Table rows of the best combination of each structure and the continuous optimum."""
    cells = []
    for name in TABLES:
        own = [i for i in choice.order if choice.combination(i)["structure"] == name]
        for i in own[:1]:
            what = ", ".join(list(choice.combination(i).values())[1:])
            cells.append((f"best with a {name}", *(f"{x:.4g}" for x in choice.values[i] * (1e3, 1.0)), what))
    shown = [variable.scale.value(x) for variable, x in zip(design.free.variables, design.x, strict=True)]
    values = ", ".join(f"{v.name} {x:.5g}{v.scale.text}" for v, x in zip(design.free.variables, shown, strict=True))
    time, current = _objectives(design)
    return [*cells, ("continuous optimum", f"{1e3 * time:.4g}", f"{current:.4g}", values)]


def _objectives(design: Design) -> tuple[float, float]:
    """Opening time and holding current of the continuous optimum."""
    (current,) = (result.value for result in design.results if result.limit.name == HOLDING)
    return design.objective, current


def _report(choice: Choice, design: Design, out: Path) -> None:
    import matplotlib.pyplot as plt

    from ._output import save
    from ._report import write_report

    figure, ax = plt.subplots(figsize=(7.0, 3.0), layout="constrained")
    names, counts = list(choice.reasons), list(choice.reasons.values())
    bars = ax.barh(names, [number for number, _ in counts], color="0.75", label="by this among others")
    ax.barh(names, [alone for _, alone in counts], color="tab:blue", label="by this alone")
    ax.bar_label(bars, padding=3, fontsize="small")
    ax.set_xscale("log")
    ax.set_xlim(1.0, 5.0 * max(number for number, _ in counts))
    ax.set_xlabel("combinations ruled out")
    ax.invert_yaxis()
    ax.legend(frameon=False)
    products = choice.plot(beside={"continuous optimum": _objectives(design)})
    for (name, (opened, held)), mark in zip(MEASURED.items(), "Ds", strict=True):
        products.plot(1e3 * opened, held, mark, color="black", mfc="none", label=f"thesis, measured: {name}")
    products.legend(frameon=False, fontsize="small")
    pictures = {
        "catalogue": products.figure,
        "catalogue_limits": figure,
    }
    for name, picture in pictures.items():
        save(picture, out, name)
    parts = [
        ("Combinations of products", str(choice), list(pictures.values())),
        ("Continuous optimum", str(design), [design.plot()]),
    ]
    write_report(out, "catalogue", "Choice of catalogue parts", parts, __doc__)

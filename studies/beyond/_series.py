"""Scatter of the opening time in series production, and the tolerances to tighten.

Tolerances are typical of data sheets and drawings. They are uniform, because parts are sorted at their limits. Those of
the seal, the clutch and the friction of the drive are assumed.
"""

import functools as ft
from typing import Any

from acausal.design import Spread, Tolerance, Uniform

from ..actuators import opening
from ._prototypes import FISE, PROTOTYPES, RE40, RE50
from ._row import Row

ITEM = "series"
MEMBERS, SEED = 500, 20120
ANY = {
    "motor.resistor.R": 7.0, "motor.emf.k": 5.0, "motor.rotor.J": 3.0, "motor.bearing.C": 20.0, "clutch.rate": 8.0,
    "line.stiffness": 20.0, "line.damping": 30.0, "slave.bore": 0.3, "supply.V": 4.0,
}  # fmt: skip
CAM = ANY | {"cam.profile.eccentricity": 0.5, "master.bore": 0.3}
PUMP = ANY | {"pump.displacement": 3.0}
SHORT = {
    "motor.resistor.R": "winding", "motor.emf.k": "magnets", "motor.rotor.J": "rotor", "motor.bearing.C": "friction",
    "clutch.rate": "clutch spring", "line.stiffness": "stiffness of the liquid",
    "line.damping": "damping of the liquid", "slave.bore": "slave cylinder", "supply.V": "supply",
    "cam.profile.eccentricity": "cam", "master.bore": "master cylinder", "pump.displacement": "pump",
}  # fmt: skip
SHARES = {FISE: CAM, RE50: CAM, RE40: PUMP}  # in per cent


def study(name: str, rtol: float = 1e-9) -> Tolerance[Any]:
    """The opening time of a prototype with the tolerances in per cent."""
    distributions = {path: Uniform(f"-{share} %", f"+{share} %") for path, share in SHARES[name].items()}
    results = {"opening time": (lambda s: s.t1, "ms")}
    run = ft.partial(opening, rtol=rtol, t_max=2.0, save="end")
    return Tolerance(PROTOTYPES[name].build(), distributions, results, run=run)


def tightened(spread: Spread) -> dict[str, float]:
    """Reduction in s of the standard deviation if one tolerance is halved; the largest first.

    To first order, the variances add. Halving the tolerance of a parameter with the share f of the variance multiplies
    the standard deviation by sqrt(1 - 3 f/4).
    """
    gains = {name: spread.std * (1.0 - (1.0 - 0.75 * share) ** 0.5) for name, share in spread.shares.items()}
    return dict(sorted(gains.items(), key=lambda item: -item[1]))


def rows(rtol: float = 1e-9, members: int = MEMBERS) -> list[Row]:
    """Rows of the spreads of the three prototypes, and of the effect of halving a tolerance."""
    table = []
    for name, (_, measured) in PROTOTYPES.items():
        tolerance = study(name, rtol)
        first = tolerance.first_order()["opening time"]
        drawn = tolerance.monte_carlo(members, seed=SEED)["opening time"]
        table += [
            Row(ITEM, name, "mean opening time", "s", drawn.mean, measured, f"{members} specimens"),
            Row(ITEM, name, "standard deviation", "s", drawn.std, None, f"first order: {1e3 * first.std:.3g} ms"),
            Row(ITEM, name, "99th percentile", "s", drawn.percentile(99.0)),
        ]
        for path, gain in list(tightened(first).items())[:4]:
            remark = f"{100.0 * first.shares[path]:.0f} % of the variance"
            table.append(
                Row(
                    ITEM,
                    f"{name}: {SHORT[path]} within half its tolerance",
                    "reduction of the deviation",
                    "s",
                    gain,
                    None,
                    remark,
                )
            )
    return table

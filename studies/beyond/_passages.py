"""Drilled passages in the housing of the electrohydraulic actuator: pressure drop, and diameters of minimum mass.

According to the thesis, its steady laminar CFD with transformer oil shows a small pressure drop; it gives no number and
no lengths. The lengths of the passages, their corners and the wall thickness are assumed.
"""

import math
from typing import Any

import jax.numpy as jnp

from acausal import Component, Connections, Scalar, connect, simulate
from acausal.design import Design, optimise
from components.hydraulic import AnyLiquid, ConstantFlow, DrilledPassage, Tank, dot_4, transformer_oil

from ..actuators import ehs_maxon, line_pressure, opening
from ._row import Row

ITEM = "passages"
LAMINAR = 2300.0  # Reynolds number up to which the flow in a pipe is laminar
DIAMETER = 4e-3  # m, equal to the bore of the holding valve
ERGAL = 2810.0  # kg/m3, density of 7075-T6, the material of the housing in the thesis
WALL = 4e-3  # m, wall thickness around a passage
DROP = 0.2e5  # Pa, allowed pressure drop on the pressure side; half of it on the suction side
CELSIUS = 20.0
SECTIONS = {"suction": (40e-3, 1.0), "pump": (35e-3, 1.0), "valve": (45e-3, 1.0), "outlet": (25e-3, 0.0)}


def metal(passage: DrilledPassage) -> Scalar:
    """The mass in kg of a square bar around the hole."""
    side = passage.diameter + 2.0 * WALL
    return ERGAL * passage.length * (side**2 - 0.25 * jnp.pi * passage.diameter**2)


class Housing(Component):
    """Tank, suction passage, and three passages in series on the pressure side, with the flow of the pump."""

    suction: DrilledPassage
    pump: DrilledPassage
    valve: DrilledPassage
    outlet: DrilledPassage
    flow: ConstantFlow
    inlet: Tank = Tank()
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.flow.port, self.suction.a),
            connect(self.suction.b, self.pump.a),
            connect(self.pump.b, self.valve.a),
            connect(self.valve.b, self.outlet.a),
            connect(self.outlet.b, self.tank.port),
        )

    @property
    def drop(self) -> Scalar:
        """The pressure drop in Pa of the pressure side."""
        return self.pump.dp + self.valve.dp + self.outlet.dp

    @property
    def mass(self) -> Scalar:
        """The mass in kg around all passages."""
        return metal(self.suction) + metal(self.pump) + metal(self.valve) + metal(self.outlet)


def largest_flow(rtol: float = 1e-8) -> float:
    """The peak flow in m3/s into the slave during the opening."""
    run = opening(ehs_maxon(), rtol=rtol)
    return float(jnp.max(run.piston.v) * ehs_maxon().slave.area)


def housing(flow: float, liquid: AnyLiquid) -> Housing:
    """The housing as built, at a flow in m3/s."""
    parts: dict[str, Any] = {
        name: DrilledPassage(diameter=DIAMETER, length=length, corners=corners, liquid=liquid)
        for name, (length, corners) in SECTIONS.items()
    }
    return Housing(**parts, flow=ConstantFlow(flow=flow))


def steady(model: Housing) -> Housing:
    """The steady state at this flow."""
    return simulate(model, 1.0, save="end").final


def lightest(flow: float, drop: float = DROP) -> Design[Housing]:
    """The design of minimum mass within a given pressure drop."""
    return optimise(
        housing(flow, dot_4(CELSIUS + 273.15)), {f"{name}.diameter": ("1 mm", "10 mm") for name in SECTIONS},
        {"mass": (lambda s: s.mass, "g")}, run=steady,
        constraints={
            "drop": (lambda s: s.drop, f"<= {drop} Pa"), "suction": (lambda s: s.suction.dp, f"<= {0.5 * drop} Pa"),
        },
        sensitivities=False, progress=False,
    )  # fmt: skip


def rows() -> list[Row]:
    """Rows of the pressure drops of the housing as built, and of the housing of minimum mass."""
    flow = largest_flow()
    open_pressure = float(line_pressure(ehs_maxon()))
    table = [Row(ITEM, "opening, EHS, RE40", "largest flow", "m3/s", flow)]
    liquids = {"transformer oil at 40 C": transformer_oil(313.15)} | {
        f"DOT 4 at {celsius:g} C": dot_4(celsius + 273.15) for celsius in (-30.0, CELSIUS, 80.0)
    }
    for name, liquid in liquids.items():
        state = steady(housing(flow, liquid))
        share = f"{100.0 * float(state.drop) / open_pressure:.2g} % of the pressure at 12 mm; thesis: small"
        table.append(Row(ITEM, f"{name}, all 4 mm", "pressure drop", "Pa", float(state.drop), None, share))
        number = float(state.valve.reynolds)
        remark = "" if number < LAMINAR else "not laminar: the actual friction is up to twice as large"
        table.append(Row(ITEM, f"{name}, all 4 mm", "Reynolds number", "1", number, None, remark))
    before = float(steady(housing(flow, dot_4(CELSIUS + 273.15))).mass)
    table.append(Row(ITEM, "all 4 mm", "mass around the passages", "kg", before))
    found = lightest(flow)
    case = f"lightest at {1e-5 * DROP:g} bar, DOT 4 at {CELSIUS:g} C"
    residual = f"{found.status}, KKT residual {found.kkt_residual:.0e}"
    table.append(Row(ITEM, case, "mass around the passages", "kg", found.objective, None, residual))
    table += [Row(ITEM, case, name, "m", value) for name, value in found.values.items()]
    price = found.multipliers.get("drop", math.nan)
    table.append(Row(ITEM, case, "mass saved per allowed drop", "kg/Pa", price))
    return table

"""The load of a real clutch: diaphragm spring with wear, cushion spring of the facings, release bearing with friction.

The test rig of the thesis has a linear spring instead; its figure 3.3 shows the release curve of a clutch without
numbers. The diaphragm spring has typical sizes. With limited wear, it takes the 800 N that the thesis states. Fork,
cushion and bearing friction are assumed.
"""

import dataclasses
import functools as ft
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Component, Connections, Scalar, connect
from components.translational import (
    Diaphragm,
    DiaphragmClutch,
    ElastoGap,
    Fixed,
    Flange,
    Lever,
    SmoothStribeckFriction,
)

from ..actuators import STROKE, WORN_LOAD, ClutchActuator, opening, spring_rate
from ._prototypes import PROTOTYPES, RE50, Prototype
from ._row import Row

ITEM = "clutch load"
# A clutch of 228 mm with H/t = 1.7: clamp load 4.4 kN, release load at the slave 803 N with limited wear.
SPRING = Diaphragm(R=114.5e-3, r=89e-3, R_1=112.5e-3, r_1=90.5e-3, r_f=29e-3, t=2.6e-3, H=4.42e-3)
FORK = 2.0  # travel of the slave relative to the release bearing
CUSHION = 0.6e-3  # m, compression of new facings
ENGAGED, WEAR = 3.2e-3, 1.0e-3  # m, deflection of the closed spring with new facings, and its reduction by limited wear
BEARING = 0.05  # friction of the release bearing on its guide, relative to the peak load
LATEST = 1.0  # s, limit of a run
RIG, NEW, WORN, STIFF = "rig's spring", "new facings", "worn facings", "worn facings, bearing friction"


class ReleaseMechanism(Component):
    """Fork, release bearing with friction, diaphragm spring, and the cushion spring that supports it when closed."""

    fork: Lever
    bearing: SmoothStribeckFriction
    spring: DiaphragmClutch
    cushion: ElastoGap
    wall: Fixed = Fixed()
    flange: Flange = Flange()

    def connections(self) -> Connections:
        return (
            connect(self.flange, self.fork.a),
            connect(self.fork.b, self.bearing.flange, self.spring.flange, self.cushion.b),
            connect(self.cushion.a, self.wall.flange),
        )


def slave_load(mechanism: ReleaseMechanism, s: Scalar) -> Scalar:
    """The load in N at the slave travel s in m, without friction and inertia."""
    spring, x = mechanism.spring.spring, s / FORK
    release = spring.force(mechanism.spring.engaged - mechanism.spring.wear + x / spring.lever) / spring.lever
    carried = mechanism.cushion.c * jnp.maximum(mechanism.cushion.s_rel0 - x, 0.0)
    return (release - carried) / FORK


def mechanism(wear: Scalar = 0.0, friction: Scalar = 0.0) -> ReleaseMechanism:
    """The clutch with facing wear in m and bearing friction in N."""
    stiffness = SPRING.force(ENGAGED) / (SPRING.lever**2 * CUSHION)
    closed = SPRING.force(ENGAGED - wear) / SPRING.lever
    return ReleaseMechanism(
        fork=Lever(arm_a=FORK, arm_b=-1.0),
        bearing=SmoothStribeckFriction(Fc=friction, Fs=friction, vs=0.01, v0=1e-3),
        spring=DiaphragmClutch(spring=SPRING, engaged=ENGAGED, wear=wear),
        cushion=ElastoGap(c=stiffness, d=0.0, s_rel0=closed / stiffness),
    )


def loads() -> dict[str, ReleaseMechanism]:
    """The clutches by name."""
    return {NEW: mechanism(), WORN: mechanism(WEAR), STIFF: mechanism(WEAR, BEARING * WORN_LOAD * FORK)}


def curves() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Travel of the slave in m and loads in N, for the plot."""
    travel = np.linspace(0.0, STROKE, 241)
    found = {
        name: np.asarray(jax.vmap(ft.partial(slave_load, one))(jnp.asarray(travel))) for name, one in loads().items()
    }
    return travel, {RIG: float(spring_rate(PROTOTYPES[RE50].build())) * travel, NEW: found[NEW], WORN: found[WORN]}


def rows(rtol: float = 1e-9, actuators: Mapping[str, Prototype] = PROTOTYPES) -> list[Row]:
    """Rows of the opening times of the prototypes with each load, and of the work to open."""
    travel, found = curves()
    table = [
        Row(
            ITEM, name, "work to open", "J", float(np.trapezoid(load, travel)),
            remark=f"peak {np.max(load):.0f} N, open {load[-1]:.0f} N",
        )
        for name, load in found.items()
    ]  # fmt: skip
    for name, (build, measured) in actuators.items():
        base = build()
        cases: Mapping[str, ClutchActuator] = {RIG: base} | {
            case: dataclasses.replace(base, clutch=one) for case, one in loads().items()
        }
        for case, model in cases.items():
            time = float(opening(model, t_max=LATEST, save="end", rtol=rtol).t1)
            table.append(Row(ITEM, f"{name}, {case}", "opening time", "s", time, measured if case == RIG else None))
    return table

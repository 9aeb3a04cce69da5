"""Master cylinder, slave cylinder and line with a liquid that carries heat, against closed forms."""

from typing import Any

import jax
import numpy as np
import pytest
from _rig import Rig

from acausal import Component, Connections, ParameterError, Scalar, SimulationError, connect, simulate
from components.blocks import Sine
from components.hydraulic import (
    ConstantFlow,
    LaminarResistance,
    Line,
    MasterCylinder,
    SlaveCylinder,
    Tank,
    fill,
    iso_vg_46,
)
from components.thermal import FixedTemperature, HeatPort, ThermalConductor
from components.translational import ConstantForce, Fixed, Mass, SignalPosition, SpringDamper

OIL = iso_vg_46(temperature=293.15, carries_heat=True)
CAPACITY = float(OIL.reference_density * OIL.caloric.specific_heat)  # type: ignore[union-attr]
BORE = 0.02
AREA = 0.25 * np.pi * BORE**2


def pushed(source: Any, bath: Any, cylinder: Any, load: Any) -> Connections:
    return (
        connect(source.heat, bath.port),
        connect(source.port, cylinder.port),
        connect(cylinder.rod, load.flange),
    )


def test_hot_oil_mixes_in_a_slave_cylinder() -> None:
    """V T = V_0 T_0 + q t T_in with V = V_0 + q t: the flow is fast enough that conduction does not matter."""
    q, volume, hot = 2e-5, 5e-5, 333.15

    def end(volume: Scalar) -> Scalar:
        parts = (
            ConstantFlow(flow=q, heat=HeatPort()),
            FixedTemperature(temperature=hot),
            SlaveCylinder(bore=BORE, volume=volume),
            ConstantForce(force=-500.0),
        )
        rig = fill(Rig(parts=parts, wiring=pushed), OIL)
        return simulate(rig, 4.0, save="end", rtol=1e-9).final.parts[2].heat.T

    value, slope = jax.value_and_grad(end)(volume)
    way = q * 4.0
    np.testing.assert_allclose(value, (volume * 293.15 + way * hot) / (volume + way), rtol=1e-8)
    np.testing.assert_allclose(slope, (293.15 - hot) * way / (volume + way) ** 2, rtol=1e-6)


def flowing(source: Any, bath: Any, line: Any, throttle: Any, tank: Any) -> Connections:
    return (
        connect(source.heat, bath.port),
        connect(source.port, line.a),
        connect(line.b, throttle.a),
        connect(throttle.b, tank.port),
    )


def test_a_line_is_a_mixed_volume() -> None:
    """Under a flow q of hot oil its temperature approaches that of the oil with the time constant volume/q."""
    q, volume, hot = 1e-5, 2e-5, 333.15
    parts = (
        ConstantFlow(flow=q, heat=HeatPort()),
        FixedTemperature(temperature=hot),
        Line.from_bulk_modulus(bulk_modulus=1.5e9, volume=volume),
        LaminarResistance(resistance=1e8),
        Tank(),
    )
    rig = fill(Rig(parts=parts, wiring=flowing), OIL)
    times = np.array([1.0, 3.0])
    run = simulate(rig, 3.0, save=times, rtol=1e-9)
    exact = hot - (hot - 293.15) * np.exp(-q / volume * times)
    np.testing.assert_allclose(run["parts[2].heat.T"], exact, rtol=1e-5)


class Transmission(Component):
    """A master cylinder drives a slave cylinder with a load to and fro through a line with losses."""

    drive: SignalPosition
    stroke: Sine
    master: MasterCylinder
    line: Line
    slave: SlaveCylinder
    mass: Mass
    spring: SpringDamper
    frame: Fixed
    wall: ThermalConductor
    room: FixedTemperature

    def connections(self) -> Connections:
        line: Any = self.line
        return (
            connect(self.stroke.y, self.drive.u),
            connect(self.drive.flange, self.master.rod),
            connect(self.master.port, line.a),
            connect(line.b, self.slave.port),
            connect(self.slave.rod, self.mass.a),
            connect(self.mass.b, self.spring.b),
            connect(self.spring.a, self.frame.flange),
            connect(line.heat, self.wall.a),
            connect(self.wall.b, self.room.port),
        )


def transmission(volume: float = 3e-5) -> Transmission:
    return Transmission(
        drive=SignalPosition(),
        stroke=Sine(amplitude=0.02, frequency=2.0),
        master=MasterCylinder(bore=BORE, volume=volume),
        line=Line(stiffness=1.5e9 / 2e-5, volume=2e-5, damping=1e11, heat=HeatPort()),
        slave=SlaveCylinder(bore=0.03, volume=volume),
        mass=Mass(m=2.0),
        spring=SpringDamper(c=1e4, d=1e3),
        frame=Fixed(),
        wall=ThermalConductor(G=0.5),
        room=FixedTemperature(temperature=283.15),
    )


def test_the_account_of_a_transmission_closes() -> None:
    """The loss of the line stays in the liquid, or leaves through the wall, as all of it does without heat."""
    warm, cold = (
        simulate(model, 3.0, save="end", energy=True, rtol=1e-8).energy
        for model in (fill(transmission(), OIL), transmission())
    )
    assert abs(warm.imbalance) < 1e-6 * warm.supplied["drive"]
    assert {path for path, value in warm.dissipated.items() if abs(value) > 0.0} == {"spring"}
    kept = sum(warm.stored[path] for path in ("line", "master", "slave"))
    lost = cold.stored["line"] - cold.supplied["room"]
    assert lost > 0.01
    np.testing.assert_allclose(kept - warm.supplied["room"], lost, rtol=1e-3)


def test_the_motion_is_that_without_heat() -> None:
    """The laws of pressure and flow do not depend on the temperature, nor on the stated volume."""
    models = fill(transmission(), OIL), transmission(1e-3)
    runs = [simulate(model, 1.0, save=[0.3, 1.0], rtol=1e-9) for model in models]
    np.testing.assert_allclose(runs[0]["mass.v"], runs[1]["mass.v"], rtol=1e-6)


def test_what_parts_with_heat_refuse() -> None:
    """Without a volume of liquid there is no temperature; an empty cylinder ends the run."""
    for part in (MasterCylinder(bore=BORE), SlaveCylinder(bore=BORE), Line(stiffness=1e13)):
        with pytest.raises(ParameterError, match="volume must be positive, because the liquid carries heat"):
            simulate(fill(part, OIL), 1.0)
    with pytest.raises(SimulationError, match=r"master\.heat\.T.*has no temperature: add a stop, or increase"):
        simulate(fill(transmission(3e-6), OIL), 1.0)

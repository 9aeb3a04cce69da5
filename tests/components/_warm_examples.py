"""Parts whose liquid carries heat, with parameters of order one, so that a point of order one exercises every term."""

from typing import Any

from _fluid_examples import CYLINDER, HOLE, LIQUID, OIL, PUMP, SIZE, SPOOL

from acausal import Component
from components import hydraulic
from components.thermal import HeatPort

WARM = hydraulic.Liquid(caloric=hydraulic.Caloric(specific_heat=0.8, conductance=0.7), **LIQUID)
EXCHANGER: dict[str, Any] = dict(UA=1.3, resistance_1=0.7, resistance_2=0.4)

COLD: tuple[Component, ...] = (
    hydraulic.CirculationPump(dp_max=1.3, q_max=0.7, power=9.0),
    hydraulic.FlowVolume(volume=1.3, resistance=0.7),
    hydraulic.HeatExchanger(arrangement=hydraulic.CounterFlow(), **EXCHANGER),
    hydraulic.PipeWall(G=1.3, inside=hydraulic.WallPort(nodes=4)),
    hydraulic.Radiator(Q_nominal=1.3, volume=0.7, dT_nominal=2.0, resistance=0.4, heat=HeatPort()),
    hydraulic.ThermostaticValve(
        rated_flow=1.3, rated_drop=0.7, T_closed=293.0, band=0.9, tau=0.4, leakage=0.1, transition_pressure=0.6
    ),
    hydraulic.Vessel(area=1.3, density=0.7, height=2.0, heights=[0.3, 0.6], pressure=0.4, g=0.9),
)

FILLED: tuple[Component, ...] = tuple(
    hydraulic.fill(part, WARM)
    for part in (
        *(part for part in COLD if not isinstance(part, hydraulic.PipeWall | hydraulic.CirculationPump)),
        hydraulic.AnnularGap(diameter=0.7, clearance=0.9, length=0.8, liquid=OIL),
        hydraulic.Chamber(volume=1.3, liquid=OIL, wall=0.1),
        hydraulic.ConstantFlow(flow=0.7),
        hydraulic.ConstantPressure(pressure=0.7, heat=HeatPort()),
        hydraulic.Cooler(resistance=0.7, UA=1.3),
        hydraulic.DoubleActingCylinder(liquid=OIL, **CYLINDER),
        hydraulic.FixedPump(**PUMP),
        hydraulic.FlowSensor(),
        hydraulic.FourWayValve(**SPOOL),
        hydraulic.HeatExchanger(arrangement=hydraulic.CrossFlow(), **EXCHANGER),
        hydraulic.LevelTank(area=1.3, density=0.7, height=2.0),
        hydraulic.LiquidOrifice(**HOLE),
        hydraulic.Line(stiffness=1.3, damping=0.6, volume=9.0),
        hydraulic.MasterCylinder(bore=0.9, volume=9.0),
        hydraulic.SlaveCylinder(bore=0.9, volume=9.0),
        hydraulic.StoppedCylinder(bore=0.9, stroke=0.7, volume=9.0),
        hydraulic.Pipe(n=3, liquid=OIL, wall=0.1, **SIZE),
        hydraulic.PressureSensor(),
        hydraulic.ShuttleValve(rated_flow=1.3, rated_drop=0.7, band=0.8, transition_pressure=0.6),
        hydraulic.SingleActingCylinder(bore=1.3, liquid=OIL, dead=3.0),
        hydraulic.SpringAccumulator(capacity=0.8, resistance=0.6, preload=0.5, stiffness=0.7),
        hydraulic.Volume(volume=1.3, bulk_modulus=5.0),
    )
)

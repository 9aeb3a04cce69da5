"""Parts that hold a liquid or gas, with parameters of order one, so that a point of order one exercises every term."""

from typing import Any

from acausal import Component
from components import blocks, hydraulic
from components.thermal import HeatPort

# A liquid under pressures of its own order, which cavitates; and the linear one, which takes tension.
LIQUID: dict[str, Any] = dict(
    density=1.2, bulk_modulus=5.0, nu_1=4.0, nu_2=2.0, T_1=1.0, T_2=2.0, temperature=1.4, T_ref=1.0, stiffening=0.3,
    softening=0.2, expansion=0.1, thickening=0.1, air=0.3, atmosphere=1.3, transition_pressure=0.2, vapour_pressure=0.4,
)  # fmt: skip
OIL = hydraulic.Liquid(**LIQUID)
LINEAR = hydraulic.LinearLiquid(density=1.2, bulk_modulus=5.0, viscosity=0.3)
SIZE: dict[str, Any] = dict(length=0.9, diameter=0.7)
LOSSES = dict(C_s=0.3, C_v=0.4, C_f=0.2, T_c=0.1)
WILSON = hydraulic.WilsonLosses(**LOSSES)
SCHLOESSER = hydraulic.SchloesserLosses(C_st=0.2, C_h=0.3, p_t=0.6, **LOSSES)
PUMP: dict[str, Any] = dict(displacement=1.3, J=0.7, liquid=OIL, losses=SCHLOESSER)
SPOOL: dict[str, Any] = dict(
    rated_flow=1.3, rated_drop=0.7, lap=0.2, lap_return=-0.1, leakage=0.1, transition_pressure=0.6
)
LAGGING: dict[str, Any] = dict(rated_flow=1.3, rated_drop=0.7, tau=0.4, leakage=0.1, transition_pressure=0.6)
PILOTED: dict[str, Any] = LAGGING | dict(band=0.8)
GAS: dict[str, Any] = dict(capacity=0.8, resistance=0.6, volume=30.0, precharge=0.5, atmosphere=1.3)
HOLE: dict[str, Any] = dict(area=0.4, liquid=OIL, transition_reynolds=2.0)
CYLINDER: dict[str, Any] = dict(bore=1.3, rod=0.7, stroke=0.6, dead_a=3.0, dead_b=4.0, leakage=0.2)
BYPASS = hydraulic.CheckValve(conductance=1.3, cracking_pressure=0.5, transition_pressure=0.6)
MAP = hydraulic.MappedLosses(
    speeds=[0.5, 2.0, 90.0],
    pressures=[0.3, 1.0, 90.0],
    slips=[[0.1, 0.2, 0.4], [0.2, 0.3, 0.5], [0.3, 0.5, 0.8]],
    drags=[[0.2, 0.4, 0.5], [0.3, 0.5, 0.6], [0.4, 0.7, 0.9]],
    p_t=0.7,
)
EDGE = hydraulic.MeteringEdge(width=1.3, stroke=0.8, density=1.2, lap=0.1, leak=0.05, transition_pressure=0.6)
STAGE = hydraulic.PilotStage(w=1.3, D=0.4, rate=0.7)
LOSS = hydraulic.LocalLoss(zeta_ab=0.7, zeta_ba=0.4, **HOLE)
POPPET: dict[str, Any] = dict(seat=0.7, width=1.3, stroke=0.8, density=1.2, transition_pressure=0.6)

FLUID: tuple[Component, ...] = (
    hydraulic.AnnularGap(diameter=0.7, clearance=0.9, length=0.8, liquid=OIL, eccentricity=0.4),
    hydraulic.BootstrapTank(area=1.3, pilot_area=0.4, stroke=0.9, preload=0.3, rate=0.7, damping=0.2),
    hydraulic.BypassCompensator(margin=0.3, **PILOTED),
    hydraulic.Chamber(volume=1.3, liquid=OIL, wall=0.1),
    hydraulic.Chamber(volume=1.3, liquid=LINEAR, wall=0.1),
    hydraulic.Cooler(resistance=0.7, UA=1.3, density=1.2, specific_heat=0.8),
    hydraulic.ChargingValve(low=0.2, high=0.4, **LAGGING),
    hydraulic.CounterbalanceValve(pressure=0.4, ratio=1.3, **PILOTED),
    hydraulic.DecelerationValve(
        rated_flow=1.3, rated_drop=0.7, start=0.1, length=0.7, rate=0.4, leakage=0.1, transition_pressure=0.6
    ),
    hydraulic.DoubleActingCylinder(liquid=OIL, **CYLINDER),
    hydraulic.DoubleActingCylinder(liquid=LINEAR, rod_a=0.4, **CYLINDER),
    hydraulic.DrilledPassage(diameter=0.7, length=0.8, corners=1.3, liquid=OIL),
    hydraulic.DrilledPassage(diameter=0.7, length=0.8, corners=1.3, liquid=OIL, heat=HeatPort()),
    hydraulic.EndCushion(gap=0.1, length=0.7, sense=-1.0, end=0.4, **HOLE),
    hydraulic.Filter(element=hydraulic.LaminarResistance(resistance=1.3), bypass=BYPASS),
    hydraulic.FixedPump(**{**PUMP, "losses": WILSON}),
    hydraulic.FixedPump(**{**PUMP, "losses": MAP}),
    hydraulic.CharacteristicLine(liquid=LINEAR, pressure=0.4, wall=0.1, **SIZE),
    hydraulic.FixedPump(heat=HeatPort(), **PUMP),
    hydraulic.FlowControlValve(flow=1.3, margin=0.7, transition_pressure=0.6),
    hydraulic.FourWaySpool.of(EDGE),
    hydraulic.FourWayValve(**SPOOL),
    hydraulic.FourWayValve(heat=HeatPort(), **SPOOL),
    hydraulic.GasAccumulator(n=1.3, **GAS),
    hydraulic.HydraulicCylinder(
        chambers=hydraulic.DoubleActingCylinder(liquid=OIL, **CYLINDER),
        m=0.8,
        Fc=0.4,
        Fs=0.6,
        vs=0.5,
        C=0.3,
        restitution=0.5,
    ),
    hydraulic.HoldingValve(
        R=1.3, L0=0.7, g0=0.4, m=1.3, spring=0.7, preload=0.3, stroke=0.4, seat=0.2, width=0.9, density=1.7, damping=0.3
    ),
    hydraulic.LevelTank(area=1.3, density=0.7, height=2.0, pressure=0.4, g=0.9),
    hydraulic.LiquidOrifice(**HOLE),
    hydraulic.LiquidOrifice(heat=HeatPort(), **HOLE),
    hydraulic.LoadSensingPump(tau=0.4, p_set=1.3, band=0.7, margin=0.3, band_set=0.8, **PUMP),
    hydraulic.LocalLoss(zeta_ab=0.7, zeta_ba=0.4, **HOLE),
    EDGE,
    hydraulic.PilotCheckValve(cracking=0.4, ratio=1.3, **PILOTED),
    STAGE,
    hydraulic.PilotReliefValve(pressure=0.4, **PILOTED),
    hydraulic.Pipe(n=2, liquid=OIL, wall=0.1, **SIZE),
    hydraulic.Pipe(n=3, liquid=LINEAR, wall=0.1, friction=hydraulic.BlasiusFriction(), **SIZE),
    hydraulic.PoppetValve(**POPPET),
    hydraulic.PoppetValve(seated=0.8, sense=-1.0, heat=HeatPort(), **POPPET),
    hydraulic.PowerLimitedPump(tau=0.4, p_set=1.3, band=0.7, power=0.5, **PUMP),
    hydraulic.PressureCompensatedPump(tau=0.4, p_set=1.3, band=0.7, **PUMP),
    hydraulic.PressureReducingValve(pressure=0.4, **PILOTED),
    hydraulic.ProportionalReducingValve(pressure=1.4, band=0.6, dead_band=0.1, w=1.3, D=0.4, **SPOOL),
    hydraulic.ProportionalValve(spool=blocks.SecondOrder(w=1.3, D=0.4), valve=hydraulic.FourWayValve(**SPOOL)),
    hydraulic.PurgeValve(rated_flow=1.3, rated_drop=0.7, threshold=0.2, band=0.8, transition_pressure=0.6),
    hydraulic.RipplingPump(ripple=0.2, pulses=0.3, **PUMP),
    hydraulic.RotaryVaneActuator(liquid=OIL, displacement=0.7, angle=0.6, dead_a=3.0, dead_b=4.0, leakage=0.2),
    hydraulic.SequenceValve(pressure=0.4, **PILOTED),
    hydraulic.ServoPump(swash=STAGE, pump=hydraulic.VariablePump(**PUMP)),
    hydraulic.ServoValve(play=blocks.Play(width=0.3, T=0.4), stage=STAGE, valve=hydraulic.FourWayValve(**SPOOL)),
    hydraulic.ShuttleValve(rated_flow=1.3, rated_drop=0.7, band=0.8, transition_pressure=0.6),
    hydraulic.SingleActingCylinder(bore=1.3, liquid=OIL, dead=3.0),
    hydraulic.SixWayValve(bypass_flow=0.9, closed=0.7, **SPOOL),
    hydraulic.SpringAccumulator(capacity=0.8, resistance=0.6, preload=0.4, stiffness=1.3),
    hydraulic.TJunction(loss_a=LOSS, loss_b=LOSS, loss_c=LOSS),
    hydraulic.TandemCylinder(
        rear=hydraulic.DoubleActingCylinder(liquid=LINEAR, **CYLINDER),
        front=hydraulic.DoubleActingCylinder(liquid=LINEAR, rod_a=0.7, **CYLINDER),
    ),
    hydraulic.ThermalAccumulator(tau=0.4, T_0=0.9, T=1.1, kappa=1.3, **GAS),
    hydraulic.ThreeWayValve(**SPOOL),
    hydraulic.UnloadingValve(pressure=0.4, **PILOTED),
    hydraulic.UnsteadyFrictionPipe(n=2, liquid=OIL, wall=0.1, memory=hydraulic.FrictionMemory.trikha(), **SIZE),
    hydraulic.VariableOrifice(leak=0.1, **HOLE),
    hydraulic.VariablePump(**PUMP),
)

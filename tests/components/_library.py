"""An instance of every component of the library."""

import dataclasses
import inspect
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal import Component, Scalar
from components import blocks, electrical, hydraulic, planar, rotational, thermal, translational


def wave(x: Scalar) -> Scalar:
    return jnp.sin(x)


LIMITS = dict(u_max=1.0, u_min=-1.0)
CONTROL = dict(k=2.0, Ti=1.0, y_max=1.0, y_min=-1.0)
GRID = np.arange(4.0)
OIL = hydraulic.iso_vg_46()
RATED: dict[str, Any] = dict(rated_flow=1.0, rated_drop=1.0)
PILOTED: dict[str, Any] = dict(band=1.0, **RATED)
LOSS = hydraulic.LocalLoss(area=1.0, liquid=OIL, zeta_ab=1.0, zeta_ba=1.0)
PUMP: dict[str, Any] = dict(displacement=1.0, liquid=OIL, losses=hydraulic.WilsonLosses())
CYLINDER: dict[str, Any] = dict(bore=1.0, stroke=1.0, liquid=OIL, dead_a=1.0, dead_b=1.0)
GAS: dict[str, Any] = dict(capacity=0.5, resistance=1.0, volume=1.0, precharge=1.0)
PIPE = dict(n=2, length=1.0, diameter=0.1, liquid=OIL)
STAGE = hydraulic.PilotStage(w=1.0, D=1.0, rate=1.0)
EDGE = hydraulic.MeteringEdge(width=1.0, stroke=1.0, density=1.0)
# What numbers of 1 for all parameters without a default would not do.
MACHINE = electrical.DqMachine(p=2.0, psi=1.0, Ld=1.0, Lq=2.0, Rs=0.5)
NETWORK = blocks.Network.of(3, jax.random.key(0))
RISING = blocks.MonotoneCurve(heights=[0.0, 0.0], slopes=[1.0, 1.0], offsets=[1.0, -1.0])
ARGUMENTS: dict[str, dict[str, Any]] = {
    "AnnularGap": dict(diameter=1.0, clearance=1.0, length=1.0, liquid=OIL),
    "Battery": dict(Q=1.0, charges=GRID, voltages=GRID + 1.0, R0=1.0, R=[1.0, 2.0], C=[1.0, 2.0]),
    "BearingFriction": dict(speeds=GRID, torques=GRID + 1.0),
    "BrushedMotor": dict(R=1.0, k=1.0, J=1.0, winding=1.0, housing=1.0, G_wh=1.0, G_ha=1.0, L=1.0, brush=1.0),
    "BypassCompensator": dict(margin=1.0, **PILOTED),
    "Chamber": dict(volume=1.0, liquid=OIL),
    "CounterbalanceValve": dict(pressure=1.0, ratio=1.0, **PILOTED),
    "DCMotor": dict(R=1.0, k=1.0, J=1.0, L=1.0, friction=1.0),
    "PhaseInverter": dict(leg=electrical.HalfBridge(frequency=1.0)),
    "DiodeBridge": {},
    "BrakeChopper": dict(R=1.0, v_on=1.0, v_off=0.5),
    "AveragedBrakeChopper": dict(R=1.0, v_on=1.0, v_off=0.5),
    "CurrentSetpoints": dict(machine=MACHINE, i_max=1.0),
    "FieldOrientedController": dict(machine=MACHINE, bandwidth=1.0),
    "VoiceCoil": dict(R=1.0, k=1.0, m=1.0, L=1.0),
    "CrankSlider": dict(crank=1.0, rod_length=2.0),
    "DataSheetSolenoid": dict(R=1.0, L_0=1.0, rated=1.0, positions=GRID, forces=GRID),
    "DeadZone": LIMITS,
    "DiaphragmClutch": dict(
        spring=translational.Diaphragm(R=2.0, r=1.0, R_1=1.9, r_1=1.1, r_f=0.5, t=1.0, H=1.0), engaged=1.0
    ),
    "DiscSpring": dict(disc=translational.ConicalDisc(De=2.0, Di=1.0, t=1.0, h=1.0)),
    "DoubleActingCylinder": CYLINDER,
    "Driver": dict(k=2.0, Ti=1.0),
    "DrilledPassage": dict(diameter=1.0, length=1.0, corners=1.0, liquid=OIL),
    "FixedPump": PUMP,
    "Function": dict(function=wave),
    "GasAccumulator": GAS,
    "BandLimitedNoise": dict(sigma=1.0, f_min=1.0, f_max=2.0),
    "HBridge": dict(frequency=100.0),
    "ChargingValve": dict(rated_flow=1.0, rated_drop=1.0, low=0.5, high=1.0),
    "Hysteresis": dict(low=-1.0, high=1.0),
    "MovingAverage": dict(period=1.0, n=2),
    "HeatExchanger": dict(UA=1.0, resistance_1=1.0, resistance_2=1.0, arrangement=hydraulic.CounterFlow()),
    "HoldingValve": dict(
        R=1.0, L0=1.0, g0=1.0, m=1.0, spring=1.0, preload=1.0, stroke=1.0, seat=1.0, width=1.0, density=1.0
    ),
    "HydraulicCylinder": dict(chambers=hydraulic.DoubleActingCylinder(**CYLINDER), m=1.0, Fc=1.0, Fs=1.0, vs=1.0),
    "LearnedDamper": dict(curve=RISING, T=1.0, w0=1.0),
    "LearnedFriction": dict(network=NETWORK, T=1.0, ws=1.0),
    "LearnedSpring": dict(network=NETWORK, T=1.0, phi0=1.0),
    "Limiter": LIMITS,
    "LimPI": CONTROL,
    "LimPID": dict(**CONTROL, Td=0.1),
    "LiquidOrifice": dict(area=1.0, liquid=OIL),
    "LoadSensingPump": dict(tau=1.0, p_set=1.0, band=1.0, margin=1.0, band_set=1.0, **PUMP),
    "LocalLoss": dict(area=1.0, liquid=OIL, zeta_ab=1.0, zeta_ba=1.0),
    "LossyGear": dict(ratio=2.0, losses=np.array([[0.0, 0.9, 0.8, 0.1, 0.1]])),
    "LossyGearR2T": dict(
        gear=rotational.LossyGear.worm(ratio=1.0, efficiency=0.8), converter=rotational.IdealGearR2T(ratio=2.0)
    ),
    "MassWithStopAndFriction": dict(m=1.0, s_min=-1.0, s_max=1.0),
    "OpAmp": dict(v_max=1.0, v_min=-1.0),
    "CharacteristicLine": dict(length=1.0, diameter=0.1, liquid=OIL, pressure=1.0),
    "Pipe": PIPE,
    "PipeWall": dict(G=1.0, inside=hydraulic.WallPort(nodes=3)),
    "PMSM": dict(machine=MACHINE, J=1.0),
    "PMSMDrive": dict(machine=MACHINE, J=1.0, i_max=1.0, C=1.0),
    "PlanetaryGearbox": dict(ratio=3.0, loss=rotational.MeshLoss(efficiency=0.9)),
    "PlanetaryTrain": dict(stages=[rotational.PlanetaryGearbox(ratio=3.0)]),
    "PressureCompensatedPump": dict(tau=1.0, p_set=1.0, band=1.0, **PUMP),
    "SaturatingInductor": dict(Lnom=0.5, Inom=1.0, Lzer=1.0, Linf=0.1),
    "SmoothLearnedFriction": dict(network=NETWORK, T=1.0, ws=1.0, w0=1.0),
    "SnapReliefValve": dict(conductance=1.0, cracking_pressure=2.0, reseat_pressure=1.0),
    "SolenoidValve": dict(R=1.0, L0=1.0, g0=1.0, m=1.0, spring=1.0, preload=1.0, stroke=1.0, area=1.0, density=1.0),
    "Staircase": dict(times=GRID, values=GRID[1:]),
    "StateMachine": dict(transitions=[(0, 1), (1, 0)]),
    "StateSpace": dict(A=np.eye(2), B=np.ones((2, 1)), C=np.ones((1, 2))),
    "StickingPump": dict(displacement=1.0, J=1.0, Tc=1.0, Ts=1.0, ws=1.0),
    "StoppedCylinder": dict(bore=1.0, stroke=1.0),
    "SupportFriction": dict(speeds=GRID, forces=GRID + 1.0),
    "Table1D": dict(points=GRID, values=GRID),
    "Table2D": dict(points1=GRID, points2=GRID, values=np.ones((4, 4))),
    "rotational.TabulatedDamper": dict(speeds=GRID, torques=GRID),
    "TabulatedDamper": dict(speeds=GRID, forces=GRID),
    "TabulatedSpring": dict(positions=GRID, forces=GRID),
    "ThermalAccumulator": dict(tau=1.0, **GAS),
    "TimeFunction": dict(function=wave),
    "TimeSeries": dict(times=GRID, values=GRID),
    "TransferFunction": dict(b=[1.0], a=[1.0, 2.0, 3.0]),
    "Transformer": dict(L1=1.0, L2=1.0, M=0.5),
    "Trapezoid": dict(amplitude=1.0, period=4.0, rising=1.0, width=1.0, falling=1.0),
    "UniformNoise": dict(period=1.0, y_min=0.0, y_max=1.0),
    "UnsteadyFrictionPipe": PIPE,
    "Vessel": dict(area=1.0, density=1.0, height=2.0, heights=[0.0, 1.0]),
    "VariableOrifice": dict(area=1.0, liquid=OIL),
    "VariablePump": PUMP,
    "VoltageComparator": dict(v_max=1.0, v_min=-1.0, band=0.1),
    "WeightedSum": dict(k=[1.0, -1.0]),
    "WormGear": dict(ratio=3.0, loss=rotational.MeshLoss(efficiency=0.9)),
    "FourWaySpool": dict(pa=EDGE, pb=EDGE, at=EDGE, bt=EDGE),
    "PowerLimitedPump": dict(tau=1.0, p_set=1.0, band=1.0, power=1.0, **PUMP),
    "RipplingPump": dict(ripple=0.5, pulses=9.0, **PUMP),
    "RotaryVaneActuator": dict(displacement=1.0, angle=1.0, liquid=OIL, dead_a=1.0, dead_b=1.0),
    "ServoPump": dict(swash=STAGE, pump=hydraulic.VariablePump(**PUMP)),
    "ServoValve": dict(play=blocks.Play(width=0.1), stage=STAGE, valve=hydraulic.FourWayValve(**RATED)),
    "SingleActingCylinder": dict(bore=1.0, liquid=OIL, dead=1.0),
    "EndCushion": dict(area=1.0, gap=0.5, length=1.0, liquid=OIL),
    "Filter": dict(element=hydraulic.LaminarResistance(resistance=1.0), bypass=hydraulic.CheckValve(conductance=1.0)),
    "ProportionalValve": dict(spool=blocks.SecondOrder(w=1.0, D=1.0), valve=hydraulic.FourWayValve(**RATED)),
    "TandemCylinder": dict(
        rear=hydraulic.DoubleActingCylinder(**CYLINDER), front=hydraulic.DoubleActingCylinder(**CYLINDER)
    ),
    "TJunction": dict(loss_a=LOSS, loss_b=LOSS, loss_c=LOSS),
}


def _library() -> list[type]:
    modules = (blocks, electrical, hydraulic, planar, rotational, thermal, translational)
    found = [cls for module in modules for _, cls in inspect.getmembers(module, inspect.isclass)]
    return [cls for cls in found if issubclass(cls, Component) and not cls._partial]


def _built(cls: type) -> Any:
    for name in (f"{cls.__module__.split('.')[1]}.{cls.__name__}", cls.__name__):
        if name in ARGUMENTS:
            return cls(**ARGUMENTS[name])
    fields = dataclasses.fields(cls)
    return cls(**{field.name: 1.0 for field in fields if field.default is dataclasses.MISSING})


PROFILES = [
    rotational.LinearLift(rate=1.0),
    rotational.EccentricDisc(eccentricity=1.0, radius=2.0),
    rotational.FlatEccentricDisc(eccentricity=1.0),
    rotational.TabulatedLift(angles=GRID, lifts=np.zeros(4)),
    rotational.RiseDwellReturn(motion=rotational.ModifiedSine(), height=1.0, rise=1.0, dwell=1.0, fall=1.0),
    rotational.RiseDwellReturn(
        motion=rotational.BSplineMotion(controls=np.array([0.3, 0.7])), height=1.0, rise=1.0, dwell=1.0, fall=1.0
    ),
]
LIBRARY = [_built(cls) for cls in _library() if cls.__name__ != "Cam"]
LIBRARY += [rotational.Cam(profile=profile, J=1.0) for profile in PROFILES]
LIBRARY += [blocks.TimeSeries(times=GRID, values=GRID, smooth=False)]
LIBRARY += [blocks.Table1D(points=GRID, values=GRID, smooth=False, extrapolation="linear")]
LIBRARY += [blocks.Table2D(points1=GRID, points2=GRID, values=np.ones((4, 4)), smooth=False)]
LIBRARY += [rotational.PlanetaryGearbox(ratio=3.0)]

"""Every component by itself: units, power balance and gradients."""

import inspect
from typing import Any

import jax
import jax.numpy as jnp
import pytest
from _drive_examples import DRIVES
from _fluid_examples import FLUID
from _warm_examples import COLD, FILLED

from acausal import Component, Scalar
from acausal.testing import check_component
from components import blocks, electrical, hydraulic, planar, rotational, thermal, translational

DOMAINS = (blocks, electrical, hydraulic, planar, rotational, thermal, translational)

ANGLES = jnp.linspace(0.0, 2.0 * jnp.pi, 9)
LIFTS = 0.3 * (1.0 - jnp.cos(ANGLES))
MESH = rotational.MeshLoss(efficiency=0.8, transition_power=0.7)
VALVE: dict[str, Any] = dict(area=0.4, density=1.7, discharge_coefficient=0.8, transition_pressure=0.6)

MACHINE = electrical.DqMachine(p=1.3, psi=0.7, Ld=0.4, Lq=0.6, Rs=0.3)
LEG: dict[str, Any] = dict(frequency=1.3, dead_time=0.05, R_on=0.4, V_0=0.3, t_switch=0.2, i_0=0.6)
NETWORK = blocks.Network.of(3, jax.random.key(0))
RISING = blocks.MonotoneCurve(heights=[0.3, -0.4], slopes=[0.2, 0.5], offsets=[0.7, -0.3])


def square(t: Scalar) -> Scalar:
    return jnp.square(t)


# Parameters of order one, so that a random point of order one exercises every term.
EXAMPLES: tuple[Component, ...] = (
    *DRIVES,
    *FLUID,
    *COLD,
    blocks.ChirpSine(amplitude=1.3, f0=0.3, f1=0.5, duration=0.9, start_time=0.3),
    blocks.Clock(offset=0.4, start_time=0.3),
    blocks.Constant(k=1.3),
    blocks.DeadZone(u_min=-0.4, u_max=0.3),
    blocks.Derivative(T=0.7),
    blocks.Division(),
    blocks.ExpSine(amplitude=1.3, frequency=0.4, damping=0.5),
    blocks.Exponentials(height=1.3, rise_time=0.7, rise_tau=0.4, fall_tau=0.5),
    blocks.FirstOrder(T=0.7),
    blocks.Function(function=square),
    blocks.Gain(k=1.3),
    blocks.Integrator(k=1.3),
    blocks.LimPI(k=1.3, Ti=0.7, y_min=-0.4, y_max=0.3),
    blocks.LimPID(k=1.3, Ti=0.7, Td=0.2, y_min=-0.4, y_max=0.3),
    blocks.Limiter(u_min=-0.4, u_max=0.3),
    blocks.Maximum(),
    blocks.Minimum(),
    blocks.PI(k=1.3, T=0.7),
    blocks.PID(k=1.3, Ti=0.7, Td=0.2),
    blocks.PWMAverage(),
    blocks.Play(width=0.3, T=0.4),
    blocks.Product(),
    blocks.Pulse(amplitude=1.3, period=0.9),
    blocks.Ramp(height=1.3, duration=0.9),
    blocks.SawTooth(amplitude=1.3, period=0.9),
    blocks.SecondOrder(w=1.3, D=0.4),
    blocks.Sine(amplitude=1.3, frequency=0.4, start_time=0.3),
    blocks.SlewRateLimiter(rising=1.3, falling=0.7, Td=0.4),
    blocks.SmoothSwitch(width=0.3),
    blocks.StateSpace(A=-jnp.eye(2), B=jnp.ones((2, 1)), C=jnp.ones((1, 2))),
    blocks.Staircase(times=jnp.array([0.0, 1.0, 3.0]), values=jnp.array([2.0, 1.0])),
    blocks.Step(height=1.3),
    blocks.Sum(k2=-1.0),
    blocks.Switch(),
    blocks.Table1D(points=jnp.arange(3.0), values=jnp.array([0.0, 2.0, 1.0])),
    blocks.Table2D(points1=jnp.arange(3.0), points2=jnp.arange(2.0), values=jnp.arange(6.0).reshape(3, 2)),
    blocks.TimeFunction(function=square),
    blocks.TimeSeries(times=jnp.array([0.0, 1.0, 3.0]), values=jnp.array([0.0, 2.0, 1.0])),
    blocks.TransferFunction(b=[1.0, 0.7], a=[0.4, 1.3, 0.9]),
    blocks.Trapezoid(amplitude=1.3, period=0.9, rising=0.2, width=0.3, falling=0.1),
    blocks.WeightedSum(k=[1.0, -0.4, 0.7]),
    electrical.AveragedBridge(),
    electrical.CCC(gain=1.3),
    electrical.CCV(R=1.3),
    electrical.Capacitor(C=1.3),
    electrical.Conductor(G=1.3),
    electrical.ConstantCurrent(I=1.3),
    electrical.ConstantVoltage(V=1.3),
    electrical.CurrentSensor(),
    electrical.DCMotor(R=1.3, k=0.7, J=0.6, L=0.8, friction=0.4),
    electrical.DCMotor(R=1.3, k=0.7, J=0.6),
    electrical.Diode(Ids=1.3, Vt=0.7, R=0.9, max_exponent=0.5),
    electrical.EMF(k=0.7),
    electrical.EMF(k=0.7, support=rotational.Flange()),
    electrical.Ground(),
    electrical.Gyrator(G=1.3),
    electrical.HeatingResistor(R_ref=1.3, T_ref=0.9, alpha=0.4),
    electrical.IdealOpAmp(),
    electrical.IdealTransformer(n=1.3),
    electrical.Inductor(L=1.3),
    electrical.Potentiometer(R=1.3),
    electrical.NegativeResistor(R=1.3),
    electrical.PowerSensor(),
    electrical.Resistor(R=1.3),
    electrical.SaturatingInductor(Lnom=0.9, Inom=0.7, Lzer=1.3, Linf=0.4),
    electrical.SignalCurrent(),
    electrical.SignalVoltage(),
    electrical.Transformer(L1=1.3, L2=0.9, M=0.7),
    electrical.TranslationalEMF(k=0.7),
    electrical.VCC(G=1.3),
    electrical.VCV(gain=1.3),
    electrical.VariableCapacitor(),
    electrical.VariableInductor(),
    electrical.VariableResistor(),
    electrical.VoltageSensor(),
    hydraulic.CheckValve(conductance=1.3, cracking_pressure=0.5, transition_pressure=0.6),
    hydraulic.ConstantFlow(flow=1.3),
    hydraulic.ConstantPressure(pressure=1.3),
    hydraulic.FlowSensor(),
    hydraulic.LaminarResistance(resistance=1.3),
    hydraulic.Line(stiffness=1.3, damping=0.6),
    hydraulic.MasterCylinder(bore=1.3),
    hydraulic.OnOffValve(**VALVE),
    hydraulic.Orifice(**VALVE),
    hydraulic.PressureSensor(),
    hydraulic.Pump(displacement=1.3, J=0.7, leakage=0.6, friction=0.4),
    hydraulic.ReliefValve(conductance=1.3, cracking_pressure=0.5, transition_pressure=0.6),
    hydraulic.SignalFlow(),
    hydraulic.SignalPressure(),
    hydraulic.SlaveCylinder(bore=1.3),
    hydraulic.Tank(),
    hydraulic.Volume(volume=1.3, bulk_modulus=0.7),
    rotational.AccelerationSensor(),
    rotational.AngleSensor(),
    rotational.ViscousFriction(C=1.3),
    rotational.Cam(profile=rotational.EccentricDisc(eccentricity=0.4, radius=1.3), J=0.7),
    rotational.Cam(profile=rotational.LinearLift(rate=0.4)),
    rotational.Cam(profile=rotational.TabulatedLift(angles=ANGLES, lifts=LIFTS), J=0.7),
    rotational.ConstantSpeed(speed=1.3),
    rotational.ConstantTorque(torque=1.3),
    rotational.Damper(d=1.3),
    rotational.Disc(delta_phi=0.4),
    rotational.EddyCurrentBrake(tau_nominal=1.3, w_nominal=0.7),
    rotational.ElastoBacklash(c=1.3, d=0.7, play=0.4),
    rotational.Fixed(phi0=0.4),
    rotational.IdealGear(ratio=-1.3),
    rotational.IdealGear(ratio=-1.3, support=rotational.Flange()),
    rotational.IdealGearR2T(ratio=1.3),
    rotational.IdealRollingWheel(radius=1.3),
    rotational.Inertia(J=1.3),
    rotational.LinearSpeedDependentTorque(torque=1.3, w_nominal=0.7),
    rotational.MultiSensor(),
    rotational.PlanetaryGear(ring_to_sun=1.3),
    rotational.PlanetaryGearbox(ratio=2.3, J_sun=0.7, J_carrier=0.6),
    rotational.PlanetaryGearbox(ratio=2.3, J_sun=0.7, J_carrier=0.6, loss=MESH),
    rotational.PowerSensor(),
    rotational.QuadraticSpeedDependentTorque(torque=1.3, w_nominal=0.7),
    rotational.QuadraticSpeedDependentTorque(torque=0.3, w_nominal=0.7, one_sign=False),
    rotational.RelativeAngleSensor(),
    rotational.LearnedDamper(curve=RISING, T=1.3, w0=0.7),
    rotational.LearnedFriction(network=NETWORK, T=1.3, ws=0.7),
    rotational.LearnedSpring(network=NETWORK, T=1.3, phi0=0.7),
    rotational.RelativeSpeedSensor(),
    rotational.SignalAcceleration(),
    rotational.SignalAngle(),
    rotational.SignalSpeed(),
    rotational.SignalTorque(),
    rotational.SignalTorque2(),
    rotational.SpeedSensor(),
    rotational.Spring(c=1.3, phi_rel0=0.4),
    rotational.TabulatedDamper(speeds=jnp.array([-0.5, 0.0, 0.8]), torques=jnp.array([-0.2, 0.0, 0.9])),
    rotational.FrictionBelt(r_a=0.4, r_b=0.7, F_0=1.3, EA=0.9, length=0.6, d=0.8, mu=0.5, wrap=2.8),
    rotational.SynchronousBelt(r_a=0.4, r_b=0.7, F_0=1.3, EA=0.9, length=0.6, d=0.8),
    rotational.TransientTyre(radius=0.4, F_z=1.3, sigma=0.3, B=0.7, C=1.6, E=-0.4),
    rotational.Tyre(radius=0.4, F_z=1.3, B=0.7, C=1.6, E=-0.4),
    rotational.SpringDamper(c=1.3, d=0.7, phi_rel0=0.4),
    rotational.SmoothLearnedFriction(network=NETWORK, T=1.3, ws=0.7, w0=0.4),
    rotational.SmoothStribeckFriction(Tc=0.7, Ts=1.3, ws=0.8, w0=0.4),
    rotational.TorqueSensor(),
    rotational.WormGear(ratio=2.3, J=0.7),
    rotational.WormGear(ratio=2.3, J=0.7, loss=MESH),
    thermal.BodyRadiation(Gr=1.3e8),
    thermal.ConstantHeatFlow(heat_flow=1.3),
    thermal.Convection(),
    thermal.FixedTemperature(temperature=1.3),
    thermal.HeatCapacitor(C=1.3),
    thermal.HeatFlowSensor(),
    thermal.RelativeTemperatureSensor(),
    thermal.SignalHeatFlow(),
    thermal.SignalTemperature(),
    thermal.TemperatureSensor(),
    thermal.ThermalConductor(G=1.3),
    translational.AccelerationSensor(),
    translational.ClutchSpring(rate=1.3, preload=0.4),
    translational.ConstantSpeed(speed=1.3),
    translational.ConstantForce(force=1.3),
    translational.Damper(d=1.3),
    translational.Driver(k=1.3, Ti=0.7, u_ff=blocks.Input()),
    translational.ElastoGap(c=1.3, d=0.7, s_rel0=0.4),
    translational.ElastoGap(c=1.3, d=0.7, s_rel0=0.4, n=1.5),
    translational.Fixed(s0=0.4),
    translational.ForceSensor(),
    translational.LinearSpeedDependentForce(force=1.3, v_nominal=0.7),
    translational.Mass(m=1.3),
    translational.Mass(m=1.3, L=0.4),
    translational.Mass(m=1.3, L=0.4, incline=0.7),
    translational.SlidingMass(m=1.3, L=0.4),
    translational.MultiSensor(),
    translational.PositionSensor(),
    translational.PowerSensor(),
    translational.QuadraticSpeedDependentForce(force=1.3, v_nominal=0.7),
    translational.QuadraticSpeedDependentForce(force=0.3, v_nominal=0.7, one_sign=False),
    translational.RelativePositionSensor(),
    translational.RelativeSpeedSensor(),
    translational.Rod(L=0.4),
    translational.Rope(EA=1.3, length=0.2, d=0.7),
    translational.Tackle(falls=1.7),
    translational.SignalAcceleration(),
    translational.SignalForce(),
    translational.SignalForce2(),
    translational.SignalPosition(),
    translational.SignalSpeed(),
    translational.SpeedSensor(),
    translational.SmoothStribeckFriction(Fc=0.7, Fs=1.3, vs=0.8, v0=0.4),
    translational.Spring(c=1.3, s_rel0=0.4),
    translational.SpringDamper(c=1.3, d=0.7, s_rel0=0.4),
    translational.TabulatedDamper(speeds=jnp.array([-0.5, 0.0, 0.8]), forces=jnp.array([-0.2, 0.0, 0.9])),
    translational.TabulatedSpring(positions=jnp.array([-0.5, 0.1, 0.8]), forces=jnp.array([0.2, 0.9, 1.1])),
    translational.Vehicle(m=1.3, area=0.7, c_d=0.4, c_r=0.3, grade=blocks.Input()),
    translational.ViscousFriction(C=1.3),
    blocks.PWM(period=0.9),
    blocks.SampleHold(period=0.9),
    blocks.And(),
    blocks.BandLimitedNoise(sigma=1.3, f_min=0.3, f_max=0.7, n=3),
    blocks.Comparator(),
    blocks.Counter(),
    blocks.Hysteresis(low=-0.4, high=0.3),
    blocks.Latch(),
    blocks.LeadLag(T1=0.9, T2=0.4, k=1.3),
    blocks.Monostable(T=0.4),
    blocks.MovingAverage(period=0.9, n=3),
    blocks.NormalNoise(period=0.9, sigma=1.3),
    blocks.Not(),
    blocks.Notch(w=1.3, D=0.4, depth=0.2),
    blocks.OnDelay(T=0.4),
    blocks.Or(),
    blocks.FixedDelay(T=0.9),
    blocks.PadeDelay(T=0.9, n=3),
    blocks.SampledDelay(period=0.9, n=2),
    blocks.SampledP(period=0.9, k=1.3),
    blocks.SampledPI(period=0.9, k=1.3, T=0.7),
    blocks.SampledPID(period=0.9, k=1.3, Ti=0.7, Td=0.3),
    blocks.StateMachine(transitions=[(0, 1), (1, 0)]),
    blocks.Timer(),
    blocks.TransportDelay(n=3),
    blocks.UniformNoise(period=0.9, y_min=-0.4, y_max=0.7),
    blocks.Xor(),
    blocks.TwoPointController(bandwidth=0.4),
    electrical.HBridge(frequency=1.3, Ron=0.4),
    electrical.IdealClosingSwitch(Ron=0.4, Goff=0.3),
    electrical.IdealCommutingSwitch(Ron=0.4, Goff=0.3),
    electrical.IdealDiode(Ron=0.4, Goff=0.3),
    electrical.IdealOpeningSwitch(Ron=0.4, Goff=0.3),
    electrical.OpAmp(gain=1.7, f_t=0.3, v_max=0.7, v_min=-0.4, slew=0.9, R_out=0.3),
    electrical.VoltageComparator(v_max=0.7, v_min=-0.4, band=0.2, R_out=0.3),
    electrical.AveragedBrakeChopper(R=1.3, v_on=0.7, v_off=0.2),
    electrical.AveragedHalfBridge(**LEG),
    electrical.BrakeChopper(R=1.3, v_on=0.7, v_off=0.2),
    electrical.DiodeBridge(diode=electrical.IdealDiode(Ron=0.4, Goff=0.3)),
    electrical.DqTerminals(p=1.3),
    electrical.HalfBridge(**LEG),
    electrical.PhaseCapacitor(C=1.3),
    electrical.PhaseImpedance(R=0.7, L=1.3),
    electrical.PhaseInverter(leg=electrical.AveragedHalfBridge(**LEG)),
    electrical.PhaseModulator(),
    electrical.PhasePins(),
    electrical.StarPoint(),
    electrical.ThreePhaseSource(V=1.3, f=0.4),
    electrical.CurrentSetpoints(machine=MACHINE, i_max=1.3),
    electrical.FieldOrientedController(machine=MACHINE, bandwidth=1.3),
    electrical.InductionMachine(p=1.3, Rs=0.4, Rr=0.3, Lm=1.7, Lssigma=0.2, Lrsigma=0.3, J=0.7),
    electrical.LinearSynchronousMotor(tau_p=1.3, psi=0.7, Ld=0.4, Lq=0.6, Rs=0.3, m=1.7, cogging=0.2),
    electrical.RotorToPhases(p=1.3),
    electrical.StepperMotor(R=0.4, L=0.7, k=1.3, N=1.7, J=0.6, detent=0.2, C=0.3),
    electrical.VoiceCoil(R=0.4, k=1.3, m=0.7, L=0.3),
    electrical.Solenoid(R=1.3, L0=0.7, g0=0.4, closed=0.3),
    hydraulic.IdealCheckValve(conductance=1.3, cracking_pressure=0.0, leakage=0.4),
    hydraulic.LiftValve(stroke=0.4, **VALVE),
    hydraulic.SnapReliefValve(conductance=1.3, cracking_pressure=0.7, reseat_pressure=0.4, leakage=0.3),
    hydraulic.SolenoidValve(
        R=1.3, L0=0.7, g0=0.4, m=1.3, spring=0.7, preload=0.3, stroke=0.4, area=0.4, density=1.7, damping=0.3
    ),
    hydraulic.StickingPump(displacement=1.3, J=0.7, Tc=0.4, Ts=0.6, ws=0.5),
    hydraulic.StoppedCylinder(bore=1.3, stroke=0.7),
    rotational.BearingFriction(speeds=jnp.array([0.0, 1.0]), torques=jnp.array([0.4, 0.7])),
    rotational.Brake(mu=0.4, fn_max=1.3),
    rotational.Brake(mu=0.4, fn_max=1.3, support=rotational.Flange()),
    rotational.Clutch(mu=0.4, fn_max=1.3),
    rotational.HardStop(phi_min=-0.4, phi_max=0.4),
    rotational.LossyGear(ratio=1.3, losses=jnp.array([[0.0, 0.8, 0.7, 0.1, 0.2]])),
    rotational.LuGreFriction(Tc=0.4, Ts=0.6, ws=0.5, stiffness=1.3, C=0.7),
    rotational.OneWayClutch(mu=0.4, fn_max=1.3),
    rotational.SpringAppliedBrake(torque=1.3, peak=1.2, support=rotational.Flange()),
    rotational.StribeckFriction(Tc=0.4, Ts=0.6, ws=0.5, C=0.7),
    translational.Brake(mu=0.4, fn_max=1.3),
    translational.Brake(mu=0.4, fn_max=1.3, support=translational.Flange()),
    translational.HardStop(s_min=-0.4, s_max=0.4),
    translational.RigidContact(restitution=0.4),
    translational.LuGreFriction(Fc=0.4, Fs=0.6, vs=0.5, stiffness=1.3, C=0.7),
    translational.MassWithStopAndFriction(
        m=1.3, L=0.1, s_min=-0.4, s_max=0.4, F_prop=0.3, F_Coulomb=0.4, F_Stribeck=0.2
    ),
    translational.TustinFriction(F_prop=0.3, F_Coulomb=0.4, F_Stribeck=0.2, fexp=0.7),
    translational.StribeckFriction(Fc=0.4, Fs=0.6, vs=0.5, C=0.7),
    translational.SupportFriction(speeds=jnp.array([0.0, 1.0]), forces=jnp.array([0.4, 0.7])),
)


LARGE = (
    electrical.CurrentSetpoints,
    electrical.DiodeBridge,
    electrical.PhaseInverter,
    electrical.PMSMDrive,
    hydraulic.DoubleActingCylinder,
    hydraulic.FixedPump,
    hydraulic.HydraulicCylinder,
    hydraulic.Pipe,
    hydraulic.RotaryVaneActuator,
)


def _case(model: Component) -> Any:
    return pytest.param(
        model, marks=[pytest.mark.thorough, pytest.mark.interpreted] if isinstance(model, LARGE) else []
    )


def _name(model: Component) -> str:
    return f"{type(model).__module__.split('.')[1]}.{type(model).__name__}"


def test_every_component_has_an_example() -> None:
    exported = {
        item
        for domain in DOMAINS
        for _, item in inspect.getmembers(domain, inspect.isclass)
        if issubclass(item, Component) and not item._partial
    }
    assert exported == {type(example) for example in EXAMPLES}


@pytest.mark.parametrize("model", [_case(model) for model in EXAMPLES], ids=_name)
def test_every_component(model: Component) -> None:
    """Units, power balance and gradients, at random points of order one."""
    check_component(model, sizes=1.0)


@pytest.mark.parametrize("model", FILLED, ids=_name)
def test_every_kind_of_part_that_carries_heat(model: Component) -> None:
    """The same, with temperatures, heat flows and stored heat."""
    check_component(model, sizes=1.0)

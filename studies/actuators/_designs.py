"""The four designs, with the set of parameters that all studies share; `parameter_set` lists the source of each value.

Gear losses are modelled only as part of the friction coefficient at the motor shaft.
"""

import math

from acausal import Scalar
from components.blocks import Constant, Ramp
from components.electrical import ConstantVoltage, DCMotor, SignalVoltage
from components.hydraulic import Line, MasterCylinder, Pump, SlaveCylinder
from components.rotational import (
    Cam,
    EccentricDisc,
    LinearLift,
    PlanetaryGearbox,
    SmoothStribeckFriction,
    StribeckFriction,
    WormGear,
)
from components.translational import ClutchSpring, Mass, ViscousFriction

from ._models import ElectrohydraulicActuator, ElectromechanicalActuator, StickingActuator, WormActuator, pump_parts
from ._parameters import NO_LOAD_FRICTION, PRESENT_RATIO, SUPPLY

SLAVE_BORE = 17.4625e-3  # m, 11/16 in
MASTER_BORE = 19.05e-3  # m, 3/4 in
LINE_STIFFNESS = 149408526513837.7  # Pa/m3, about 10 cm3 of brake fluid at 1.5 GPa
LINE_DAMPING = 6.8e11  # Pa.s/m3
SPRING_RATE = 58e3  # N/m
DISPLACEMENT = 1.25e-6 / (2.0 * math.pi)  # m3/rad

_PRESENT_TRAVEL = 1.0 / 9330.0  # m/rad, travel of the slave per angle of the motor
_PRESENT_INERTIA = 5370.0 * _PRESENT_TRAVEL**2  # kg.m2, total inertia, from 5370 kg referred to the slave
_PRESENT_CAM_INERTIA = 4.82e-5  # kg.m2
_PRESENT_ROTOR_INERTIA = 60e-6  # kg.m2


def ema_fise(
    *,
    voltage: Scalar = SUPPLY,
    resistance: Scalar = 0.133,
    inductance: Scalar | None = None,
    torque_constant: Scalar = 0.0064,
    friction: Scalar = 16e-4,
    rotor_inertia: Scalar = 60e-6,
    gearbox_inertia: Scalar = 1.5e-6,
    ratio: Scalar = 12.0,
    cam_inertia: Scalar = 3.49e-5,
    eccentricity: Scalar = 5.5e-3,
    cam_radius: Scalar = 20e-3,
    master_bore: Scalar = MASTER_BORE,
    slave_bore: Scalar = SLAVE_BORE,
    line_stiffness: Scalar = LINE_STIFFNESS,
    line_damping: Scalar = LINE_DAMPING,
    mass: Scalar = 0.3,
    piston_damping: Scalar = 2e-3,
    spring_rate: Scalar = SPRING_RATE,
) -> ElectromechanicalActuator:
    """The electromechanical actuator with a FISE motor and a 12:1 planetary gearbox."""
    return ElectromechanicalActuator(
        supply=ConstantVoltage(V=voltage),
        motor=DCMotor(R=resistance, L=inductance, k=torque_constant, J=rotor_inertia, friction=friction),
        gearbox=PlanetaryGearbox(ratio=ratio, J_sun=gearbox_inertia),
        cam=Cam(profile=EccentricDisc(eccentricity=eccentricity, radius=cam_radius), J=cam_inertia),
        master=MasterCylinder(bore=master_bore),
        line=Line(stiffness=line_stiffness, damping=line_damping),
        slave=SlaveCylinder(bore=slave_bore),
        piston=Mass(m=mass),
        seal=ViscousFriction(C=piston_damping),
        clutch=ClutchSpring(rate=spring_rate),
    )


def ema_maxon(
    *,
    voltage: Scalar = SUPPLY,
    resistance: Scalar = 0.309,
    inductance: Scalar | None = None,
    torque_constant: Scalar = 0.0385,
    friction: Scalar = 4e-3,
    rotor_inertia: Scalar = 54e-6,
    gearbox_inertia: Scalar = 2e-6,
    ratio: Scalar = 4.3,
    cam_inertia: Scalar = 3.49e-5,
    eccentricity: Scalar = 5.5e-3,
    cam_radius: Scalar = 20e-3,
    master_bore: Scalar = MASTER_BORE,
    slave_bore: Scalar = SLAVE_BORE,
    line_stiffness: Scalar = LINE_STIFFNESS,
    line_damping: Scalar = LINE_DAMPING,
    mass: Scalar = 0.3,
    piston_damping: Scalar = 2e-3,
    spring_rate: Scalar = SPRING_RATE,
) -> ElectromechanicalActuator:
    """The electromechanical actuator with a Maxon RE50 motor and a 4.3:1 planetary gearbox."""
    return ema_fise(
        voltage=voltage,
        resistance=resistance,
        inductance=inductance,
        torque_constant=torque_constant,
        friction=friction,
        rotor_inertia=rotor_inertia,
        gearbox_inertia=gearbox_inertia,
        ratio=ratio,
        cam_inertia=cam_inertia,
        eccentricity=eccentricity,
        cam_radius=cam_radius,
        master_bore=master_bore,
        slave_bore=slave_bore,
        line_stiffness=line_stiffness,
        line_damping=line_damping,
        mass=mass,
        piston_damping=piston_damping,
        spring_rate=spring_rate,
    )


def ehs_maxon(
    *,
    voltage: Scalar = SUPPLY,
    resistance: Scalar = 0.4,
    inductance: Scalar | None = None,
    torque_constant: Scalar = 0.0302,
    friction: Scalar = 4e-3,
    rotor_inertia: Scalar = 14e-6,
    pump_inertia: Scalar = 2e-6,
    displacement: Scalar = DISPLACEMENT,
    slave_bore: Scalar = SLAVE_BORE,
    line_stiffness: Scalar = LINE_STIFFNESS,
    line_damping: Scalar = LINE_DAMPING,
    mass: Scalar = 0.3,
    piston_damping: Scalar = 2e-3,
    spring_rate: Scalar = SPRING_RATE,
) -> ElectrohydraulicActuator:
    """The electrohydraulic actuator with a Maxon RE40 motor and a pump of 1.25 cm3/rev."""
    return ElectrohydraulicActuator(
        supply=ConstantVoltage(V=voltage),
        motor=DCMotor(R=resistance, L=inductance, k=torque_constant, J=rotor_inertia, friction=friction),
        pump=Pump(displacement=displacement, J=pump_inertia),
        line=Line(stiffness=line_stiffness, damping=line_damping),
        slave=SlaveCylinder(bore=slave_bore),
        piston=Mass(m=mass),
        seal=ViscousFriction(C=piston_damping),
        clutch=ClutchSpring(rate=spring_rate),
    )


def ehs_sticking(
    *,
    voltage: Scalar = SUPPLY,
    ramp: Scalar | None = 99.973e-3,
    break_away: Scalar = 0.18342,
    coulomb: Scalar = 0.05,
    stribeck_speed: Scalar = 30.0,
    width: Scalar | None = None,
    friction: Scalar = NO_LOAD_FRICTION,
    **others: Scalar,
) -> StickingActuator:
    """The electrohydraulic actuator with dry friction, which delays its motion.

    The thesis measured 30 ms without motion and gives no model for it. These parameters are one possible explanation:
    the voltage rises over the time `ramp` in s (`None`: a step), and the shaft breaks away at the torque `break_away`
    in N.m. With `width` in rad/s, the friction is smoothed over this speed; otherwise the shaft sticks. `others` are
    keywords of `ehs_maxon`.
    """
    base = ehs_maxon(friction=friction, **others)
    command = Constant(k=voltage) if ramp is None else Ramp(height=voltage, duration=ramp)
    return StickingActuator(
        supply=SignalVoltage(),
        command=command,
        bearing=(
            StribeckFriction(Ts=break_away, Tc=coulomb, ws=stribeck_speed)
            if width is None
            else SmoothStribeckFriction(Ts=break_away, Tc=coulomb, ws=stribeck_speed, w0=width)
        ),
        **pump_parts(base),
    )


def sila(
    *,
    voltage: Scalar = SUPPLY,
    resistance: Scalar = 0.133,
    inductance: Scalar | None = None,
    torque_constant: Scalar = 0.0064,
    friction: Scalar = 16e-4,
    rotor_inertia: Scalar = _PRESENT_ROTOR_INERTIA,
    gearbox_inertia: Scalar = _PRESENT_INERTIA - _PRESENT_ROTOR_INERTIA - _PRESENT_CAM_INERTIA / PRESENT_RATIO**2,
    ratio: Scalar = PRESENT_RATIO,
    cam_inertia: Scalar = _PRESENT_CAM_INERTIA,
    lift_rate: Scalar = _PRESENT_TRAVEL * PRESENT_RATIO * (SLAVE_BORE / MASTER_BORE) ** 2,
    master_bore: Scalar = MASTER_BORE,
    slave_bore: Scalar = SLAVE_BORE,
    line_stiffness: Scalar = LINE_STIFFNESS,
    line_damping: Scalar = LINE_DAMPING,
    mass: Scalar = 0.3,
    piston_damping: Scalar = 2e-3,
    spring_rate: Scalar = SPRING_RATE,
) -> WormActuator:
    """The present actuator: FISE motor, 38:1 worm, and a linear cam with `lift_rate` in m/rad."""
    return WormActuator(
        supply=ConstantVoltage(V=voltage),
        motor=DCMotor(R=resistance, L=inductance, k=torque_constant, J=rotor_inertia, friction=friction),
        gearbox=WormGear(ratio=ratio, J=gearbox_inertia),
        cam=Cam(profile=LinearLift(rate=lift_rate), J=cam_inertia),
        master=MasterCylinder(bore=master_bore),
        line=Line(stiffness=line_stiffness, damping=line_damping),
        slave=SlaveCylinder(bore=slave_bore),
        piston=Mass(m=mass),
        seal=ViscousFriction(C=piston_damping),
        clutch=ClutchSpring(rate=spring_rate),
    )

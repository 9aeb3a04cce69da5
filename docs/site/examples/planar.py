"""Examples of planar components."""

from components.planar import (
    Bar,
    Body,
    ConstantForce,
    Damper,
    DistanceSensor,
    Fixed,
    FixedTranslation,
    ForceSensor,
    LineForce,
    PositionSensor,
    Prismatic,
    Revolute,
    SignalForce,
    SpeedSensor,
    Spring,
)

EXAMPLES = (
    Bar(m=0.8, L=0.4),
    Body(m=2.0, J=0.05),
    ConstantForce(fx=100.0),
    Damper(d=50.0),
    DistanceSensor(),
    Fixed(x0=0.5),
    FixedTranslation(rx=0.3, ry=0.1),
    ForceSensor(),
    LineForce(),
    PositionSensor(),
    Prismatic(),
    Revolute(),
    SignalForce(),
    SpeedSensor(),
    Spring(c=2e3, L_0=0.4),
)

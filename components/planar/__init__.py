"""Mechanics in the plane: bodies, joints and linkages with closed loops (as in PlanarMechanics by Zimmer)."""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._bodies import Bar as Bar
    from ._bodies import Body as Body
    from ._bodies import Fixed as Fixed
    from ._bodies import FixedTranslation as FixedTranslation
    from ._forces import ConstantForce as ConstantForce
    from ._forces import Damper as Damper
    from ._forces import LineForce as LineForce
    from ._forces import SignalForce as SignalForce
    from ._forces import Spring as Spring
    from ._interfaces import AtFrame as AtFrame
    from ._interfaces import Frame as Frame
    from ._interfaces import Line as Line
    from ._interfaces import TwoFrames as TwoFrames
    from ._joints import Prismatic as Prismatic
    from ._joints import Revolute as Revolute
    from ._sensors import DistanceSensor as DistanceSensor
    from ._sensors import ForceSensor as ForceSensor
    from ._sensors import PositionSensor as PositionSensor
    from ._sensors import SpeedSensor as SpeedSensor
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)

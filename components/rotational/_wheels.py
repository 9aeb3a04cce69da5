"""Conversion of rotation to translation: wheel, rack and pinion, lead screw."""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Equations, Param, Scalar, eq, nonzero

from ..translational import Flange as Rod
from ._interfaces import Flange


class IdealGearR2T(Component):
    """phi = ratio s and ratio tau + f = 0; lossless, massless, without backlash (MSL `IdealGearR2T`).

    A rack and pinion, or a lead screw.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"flangeR": "shaft", "flangeT": "rod"}

    ratio: Param[Scalar, "rad/m", nonzero]  # angle of the shaft per travel of the rod
    shaft: Flange = Flange()
    rod: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.shaft.phi, self.ratio * self.rod.s),
            virtual_work=eq(self.ratio * self.shaft.tau + self.rod.f),
        )


class IdealRollingWheel(Component):
    """s = radius phi and tau + radius f = 0: a massless wheel that rolls without slip (MSL `IdealRollingWheel`)."""

    elsewhere: ClassVar[Mapping[str, str]] = {"flangeR": "shaft", "flangeT": "rod"}

    radius: Param[Scalar, "m", nonzero]  # radius of the wheel
    shaft: Flange = Flange()
    rod: Rod = Rod()  # moves with the axle

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.rod.s, self.radius * self.shaft.phi),
            virtual_work=eq(self.shaft.tau + self.radius * self.rod.f),
        )

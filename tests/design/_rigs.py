"""Small models that the tests of design share."""

from acausal import Component, Connections, Scalar, connect
from components.translational import Fixed, Mass, SpringDamper


class Rig(Component):
    """A mass between a wall and a spring with damper, let go: m a + d v + c s = 0."""

    mass: Mass
    link: SpringDamper
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return connect(self.wall.flange, self.link.a), connect(self.link.b, self.mass.a)


class Twins(Component):
    """Two of them, side by side."""

    a: Rig
    b: Rig


def rig(m: Scalar = 1.0, c: Scalar = 40.0, d: Scalar = 1.5, s0: Scalar = 0.1) -> Rig:
    return Rig(mass=Mass(m=m, v=0.0), link=SpringDamper(c=c, d=d, s_rel=s0))

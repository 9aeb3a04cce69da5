"""Mechanical circuits."""

from acausal import Component, Connections, connect
from components import blocks, rotational, translational

from .twin import Twin

SHAFTS = """
model Shafts
  import Modelica.Mechanics.Rotational;
  Rotational.Components.Inertia motor(J = 0.1, phi(start = 0, fixed = true), w(start = 2, fixed = true));
  Rotational.Components.IdealGear gear(ratio = 3, useSupport = false);
  Rotational.Components.SpringDamper shaft(c = 40, d = 0.2, phi_rel(start = 0, fixed = true));
  Rotational.Components.Inertia load(J = 0.5, w(start = 0, fixed = true));
  Rotational.Sources.ConstantTorque torque(tau_constant = 1.5, useSupport = false);
equation
  connect(torque.flange, motor.flange_a);
  connect(motor.flange_b, gear.flange_a);
  connect(gear.flange_b, shaft.flange_a);
  connect(shaft.flange_b, load.flange_a);
end Shafts;
"""


class Shafts(Component):
    motor: rotational.Inertia
    gear: rotational.IdealGear
    shaft: rotational.SpringDamper
    load: rotational.Inertia
    torque: rotational.ConstantTorque

    def connections(self) -> Connections:
        return (
            connect(self.torque.flange, self.motor.a),
            connect(self.motor.b, self.gear.a),
            connect(self.gear.b, self.shaft.a),
            connect(self.shaft.b, self.load.a),
        )


BRAKED = """
model Braked
  import Modelica.Mechanics.Rotational;
  Rotational.Components.Inertia wheel(J = 0.5, phi(start = 0, fixed = true), w(start = 6, fixed = true));
  Rotational.Components.Brake brake(mu_pos = [0, 0.5], cgeo = 0.2, fn_max = 40, peak = 1.1, useSupport = false);
  Modelica.Blocks.Sources.Ramp pressure(height = 1, duration = 0.5, startTime = 0.2);
  Rotational.Sources.ConstantTorque torque(tau_constant = 1, useSupport = false);
equation
  connect(torque.flange, wheel.flange_a);
  connect(wheel.flange_b, brake.flange_a);
  connect(pressure.y, brake.f_normalized);
end Braked;
"""


class Braked(Component):
    wheel: rotational.Inertia
    brake: rotational.Brake
    pressure: blocks.Ramp
    torque: rotational.ConstantTorque

    def connections(self) -> Connections:
        return (
            connect(self.torque.flange, self.wheel.a),
            connect(self.wheel.b, self.brake.flange),
            connect(self.pressure.y, self.brake.u),
        )


BUFFER = """
model Buffer
  import Modelica.Mechanics.Translational;
  Translational.Components.Fixed wall(s0 = 0);
  Translational.Components.Spring spring(c = 200, s_rel0 = 0.1);
  Translational.Components.Damper damper(d = 3);
  Translational.Components.Mass mass(m = 2, L = 0, s(start = 0.3, fixed = true), v(start = 0, fixed = true));
  Translational.Sources.ConstantForce force(f_constant = 5, useSupport = false);
equation
  connect(wall.flange, spring.flange_a);
  connect(spring.flange_b, mass.flange_a);
  connect(wall.flange, damper.flange_a);
  connect(damper.flange_b, mass.flange_a);
  connect(force.flange, mass.flange_b);
end Buffer;
"""


class Buffer(Component):
    wall: translational.Fixed
    spring: translational.Spring
    damper: translational.Damper
    mass: translational.Mass
    force: translational.ConstantForce

    def connections(self) -> Connections:
        return (
            connect(self.wall.flange, self.spring.a, self.damper.a),
            connect(self.spring.b, self.damper.b, self.mass.a),
            connect(self.force.flange, self.mass.b),
        )


def twins() -> list[Twin]:
    return [
        Twin(
            "Shafts",
            SHAFTS,
            Shafts(
                motor=rotational.Inertia(J=0.1, phi=0.0, w=2.0),
                gear=rotational.IdealGear(ratio=3.0),
                shaft=rotational.SpringDamper(c=40.0, d=0.2, phi_rel=0.0),
                load=rotational.Inertia(J=0.5, w=0.0),
                torque=rotational.ConstantTorque(torque=1.5),
            ),
            2.0,
            {"motor.w": "motor.w", "load.w": "load.w", "shaft.tau": "shaft.tau"},
        ),
        Twin(
            "Braked",
            BRAKED,
            Braked(
                wheel=rotational.Inertia(J=0.5, phi=0.0, w=6.0),
                brake=rotational.Brake(mu=0.5, cgeo=0.2, fn_max=40.0, peak=1.1),
                pressure=blocks.Ramp(height=1.0, duration=0.5, start_time=0.2),
                torque=rotational.ConstantTorque(torque=1.0),
            ),
            2.0,
            {"wheel.phi": "wheel.a.phi", "wheel.w": "wheel.w"},
        ),
        Twin(
            "Buffer",
            BUFFER,
            Buffer(
                wall=translational.Fixed(),
                spring=translational.Spring(c=200.0, s_rel0=0.1),
                damper=translational.Damper(d=3.0),
                mass=translational.Mass(m=2.0, s=0.3, v=0.0),
                force=translational.ConstantForce(force=5.0),
            ),
            3.0,
            {"mass.s": "mass.a.s", "mass.v": "mass.v", "damper.f": "damper.f"},
        ),
    ]

"""Electrical circuits, and a motor."""

from acausal import Component, Connections, connect
from components import blocks, electrical, rotational

from .twin import Twin

_IMPORT = "  import Modelica.Electrical.Analog;\n  Analog.Basic.Ground ground;\n"

CHARGE = f"""
model Charge
{_IMPORT}
  Analog.Sources.ConstantVoltage source(V = 10);
  Analog.Basic.Resistor resistor(R = 100);
  Analog.Basic.Capacitor capacitor(C = 1e-3, v(start = 0, fixed = true));
equation
  connect(source.p, resistor.p);
  connect(resistor.n, capacitor.p);
  connect(capacitor.n, source.n);
  connect(source.n, ground.p);
end Charge;
"""


class Charge(Component):
    source: electrical.ConstantVoltage
    resistor: electrical.Resistor
    capacitor: electrical.Capacitor
    ground: electrical.Ground

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.resistor.p),
            connect(self.resistor.n, self.capacitor.p),
            connect(self.capacitor.n, self.source.n, self.ground.p),
        )


RESONANCE = f"""
model Resonance
{_IMPORT}
  Analog.Sources.SignalVoltage source;
  Modelica.Blocks.Sources.Sine sine(amplitude = 10, f = 40, startTime = 0.01);
  Analog.Basic.Resistor resistor(R = 2);
  Analog.Basic.Inductor inductor(L = 0.02, i(start = 0, fixed = true));
  Analog.Basic.Capacitor capacitor(C = 1e-3, v(start = 1, fixed = true));
equation
  connect(sine.y, source.v);
  connect(source.p, resistor.p);
  connect(resistor.n, inductor.p);
  connect(inductor.n, capacitor.p);
  connect(capacitor.n, source.n);
  connect(source.n, ground.p);
end Resonance;
"""


class Resonance(Component):
    source: electrical.SignalVoltage
    sine: blocks.Sine
    resistor: electrical.Resistor
    inductor: electrical.Inductor
    capacitor: electrical.Capacitor
    ground: electrical.Ground

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.resistor.p),
            connect(self.resistor.n, self.inductor.p),
            connect(self.inductor.n, self.capacitor.p),
            connect(self.capacitor.n, self.source.n, self.ground.p),
        )


RECTIFIER = f"""
model Rectifier
{_IMPORT}
  Analog.Sources.SignalVoltage source;
  Modelica.Blocks.Sources.Sine sine(amplitude = 12, f = 50);
  Analog.Ideal.IdealDiode diode(Ron = 0.05, Goff = 1e-5, Vknee = 0.7);
  Analog.Basic.Resistor resistor(R = 50);
  Analog.Basic.Capacitor capacitor(C = 1e-3, v(start = 0, fixed = true));
equation
  connect(sine.y, source.v);
  connect(source.p, diode.p);
  connect(diode.n, capacitor.p);
  connect(diode.n, resistor.p);
  connect(capacitor.n, source.n);
  connect(resistor.n, source.n);
  connect(source.n, ground.p);
end Rectifier;
"""


class Rectifier(Component):
    source: electrical.SignalVoltage
    sine: blocks.Sine
    diode: electrical.IdealDiode
    resistor: electrical.Resistor
    capacitor: electrical.Capacitor
    ground: electrical.Ground

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.diode.p),
            connect(self.diode.n, self.capacitor.p, self.resistor.p),
            connect(self.capacitor.n, self.resistor.n, self.source.n, self.ground.p),
        )


MOTOR = f"""
model Motor
{_IMPORT}
  Analog.Sources.ConstantVoltage source(V = 12);
  Analog.Basic.Resistor resistor(R = 0.5);
  Analog.Basic.Inductor inductor(L = 0.01, i(start = 0, fixed = true));
  Analog.Basic.RotationalEMF emf(k = 0.1, useSupport = false);
  Modelica.Mechanics.Rotational.Components.Inertia rotor(
    J = 1e-3, phi(start = 0, fixed = true), w(start = 0, fixed = true));
equation
  connect(source.p, resistor.p);
  connect(resistor.n, inductor.p);
  connect(inductor.n, emf.p);
  connect(emf.n, source.n);
  connect(source.n, ground.p);
  connect(emf.flange, rotor.flange_a);
end Motor;
"""


class Motor(Component):
    source: electrical.ConstantVoltage
    resistor: electrical.Resistor
    inductor: electrical.Inductor
    emf: electrical.EMF
    rotor: rotational.Inertia
    ground: electrical.Ground

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.resistor.p),
            connect(self.resistor.n, self.inductor.p),
            connect(self.inductor.n, self.emf.p),
            connect(self.emf.n, self.source.n, self.ground.p),
            connect(self.emf.shaft, self.rotor.a),
        )


def twins() -> list[Twin]:
    coil = {"inductor.i": "inductor.i"}
    capacitor = {"capacitor.v": "capacitor.v"}
    return [
        Twin(
            "Charge",
            CHARGE,
            Charge(
                source=electrical.ConstantVoltage(V=10.0),
                resistor=electrical.Resistor(R=100.0),
                capacitor=electrical.Capacitor(C=1e-3, v=0.0),
                ground=electrical.Ground(),
            ),
            0.5,
            {**capacitor, "resistor.i": "resistor.i"},
        ),
        Twin(
            "Resonance",
            RESONANCE,
            Resonance(
                source=electrical.SignalVoltage(),
                sine=blocks.Sine(amplitude=10.0, frequency=40.0, start_time=0.01),
                resistor=electrical.Resistor(R=2.0),
                inductor=electrical.Inductor(L=0.02, i=0.0),
                capacitor=electrical.Capacitor(C=1e-3, v=1.0),
                ground=electrical.Ground(),
            ),
            0.2,
            {**capacitor, **coil},
        ),
        Twin(
            "Rectifier",
            RECTIFIER,
            Rectifier(
                source=electrical.SignalVoltage(),
                sine=blocks.Sine(amplitude=12.0, frequency=50.0),
                diode=electrical.IdealDiode(Ron=0.05, Goff=1e-5, Vknee=0.7),
                resistor=electrical.Resistor(R=50.0),
                capacitor=electrical.Capacitor(C=1e-3, v=0.0),
                ground=electrical.Ground(),
            ),
            0.05,
            {**capacitor, "resistor.i": "resistor.i"},
        ),
        Twin(
            "Motor",
            MOTOR,
            Motor(
                source=electrical.ConstantVoltage(V=12.0),
                resistor=electrical.Resistor(R=0.5),
                inductor=electrical.Inductor(L=0.01, i=0.0),
                emf=electrical.EMF(k=0.1),
                rotor=rotational.Inertia(J=1e-3, phi=0.0, w=0.0),
                ground=electrical.Ground(),
            ),
            0.3,
            {**coil, "rotor.w": "rotor.w", "rotor.phi": "rotor.a.phi"},
        ),
    ]

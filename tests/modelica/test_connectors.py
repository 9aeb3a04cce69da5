"""Connectors of Modelica models as ports of components."""

import math

import pytest

import components.electrical
import components.rotational as rotational
import components.thermal
import components.translational
from acausal import Component, Connections, ModelError, connect, simulate, structure
from acausal._declare.node import leaves_of
from acausal.modelica import ModelicaModel, load
from components.blocks import Constant, Input, Output

GEAR = """
connector Flange "As in the Standard Library" Real phi(unit = "rad"); flow Real tau(unit = "N.m"); end Flange;
model Gear "An ideal gear with a torque on its slow shaft"
  Flange a, b;
  input Real torque;
  parameter Real ratio = 2;
  output Real w = der(a.phi);
equation
  a.phi = ratio * b.phi;
  0 = ratio * a.tau + b.tau + torque;
end Gear;
model Wheel
  Flange a;
  Real w(start = 4, fixed = true);
equation
  w = der(a.phi);
  2 * der(w) = a.tau - 3 * w;
end Wheel;
"""

TANKS = """
connector Opening Real level; flow Real inflow; end Opening;
model Tank
  parameter Real area = 2;
  Opening opening(level(start = 1, fixed = true));
equation
  area * der(opening.level) = opening.inflow;
end Tank;
model Pipe
  Opening a, b;
equation
  a.inflow + b.inflow = 0;
  3 * a.inflow = a.level - b.level;
end Pipe;
"""


class Drive(Component):
    """A torque on the slow shaft of a gear between two inertias."""

    gear: ModelicaModel
    fast: rotational.Inertia
    slow: rotational.Inertia
    torque: Constant

    def connections(self) -> Connections:
        return (
            connect(self.gear.a, self.fast.b),
            connect(self.gear.b, self.slow.a),
            connect(self.torque.y, self.gear.torque),
        )


def test_a_modelica_gear_drives_inertias_of_the_library() -> None:
    fast, slow = rotational.Inertia(J=1.0, w=1.0), rotational.Inertia(J=1.0)
    drive = Drive(gear=load(GEAR, "Gear"), fast=fast, slow=slow, torque=Constant(k=3.0))
    solution = simulate(drive, 1.0, save="end", rtol=1e-9)
    # Both inertias on the slow shaft: (1 + 2^2) dw/dt = 3, from 1/2.
    speed = 0.5 + 3.0 / 5.0
    assert solution["slow.w"][-1] == pytest.approx(speed)
    assert solution["gear.w"][-1] == pytest.approx(2.0 * speed)
    assert solution["gear.b.tau"][-1] == pytest.approx(-3.0 / 5.0)  # positive into the gear


def test_nothing_flows_through_an_open_connector() -> None:
    solution = simulate(load(GEAR, "Wheel"), 1.0, save="end", rtol=1e-9)
    assert solution["w"][-1] == pytest.approx(4.0 * math.exp(-1.5))
    assert solution["a.tau"][-1] == 0.0


class Tanks(Component):
    """Two tanks, joined by a pipe."""

    left: ModelicaModel
    right: ModelicaModel
    pipe: ModelicaModel

    def connections(self) -> Connections:
        return connect(self.left.opening, self.pipe.a), connect(self.pipe.b, self.right.opening)


def test_connectors_of_other_kinds_connect_models_that_are_loaded_separately() -> None:
    left, right = (load(TANKS, f"Tank(opening(level(start={level}, fixed=true)))") for level in (3, 1))
    solution = simulate(Tanks(left=left, right=right, pipe=load(TANKS, "Pipe")), 2.0, save="end", rtol=1e-9)
    # The difference decays with the time constant 3 area / 2.
    assert solution["left.opening.level"][-1] == pytest.approx(2.0 + math.exp(-2.0 / 3.0))
    assert solution["right.opening.level"][-1] == pytest.approx(2.0 - math.exp(-2.0 / 3.0))


class Mixed(Component):
    """A tank at the shaft of a wheel."""

    tank: ModelicaModel
    wheel: rotational.Inertia

    def connections(self) -> Connections:
        return (connect(self.tank.opening, self.wheel.a),)


def test_unlike_connectors_are_named() -> None:
    with pytest.raises(
        ModelError,
        match=r"tank\.opening is a connector \(flow inflow, level\) and wheel\.a a Flange; only",
    ):
        simulate(Mixed(tank=load(TANKS, "Tank"), wheel=rotational.Inertia(J=1.0)), 1.0)


def test_an_open_input_of_a_part_is_named() -> None:
    class Open(Component):
        gear: ModelicaModel

    with pytest.raises(ModelError, match=r"gear\.torque is not connected"):
        simulate(Open(gear=load(GEAR, "Gear")), 1.0)


CONNECTORS = """
connector Pin Real v(unit = "V"); flow Real i(unit = "A"); end Pin;
connector Rod Real s(unit = "m"); flow Real f(unit = "N"); end Rod;
connector Heat Real T(unit = "K"); flow Real Q_flow(unit = "W"); end Heat;
connector RealInput = input Real;
connector RealOutput = output Real;
connector Plug parameter Integer m = 2; Pin pin[m]; end Plug;
model M
  Pin pin; Rod rod; Heat heat; RealInput u; RealOutput y; Plug plug; RealInput many[3];
equation
  y = u;
  pin.i + rod.f + heat.Q_flow + plug.pin[1].i + plug.pin[2].i = sum(many);
end M;
"""


def test_each_connector_is_the_port_with_its_variables() -> None:
    model = load(CONNECTORS, "M")
    assert type(model.pin) is type(model.plug.pin[2]) is components.electrical.Pin
    assert type(model.rod) is components.translational.Flange
    assert type(model.heat) is components.thermal.HeatPort
    assert (type(model.u), type(model.y)) == (Input, Output)
    assert type(model.many).__name__ == "connector (value)"


BUSES = """
package Buses
  connector In = input Real;
  connector Out = output Real;
  expandable connector Axis Real used; Real unused; Boolean flag; end Axis;
  expandable connector Bus Axis one; Axis two; Real idle; end Bus;
  model Source Bus bus; Out y = 3 * time; equation connect(y, bus.one.used); end Source;
  model Reader Bus bus; In u; Real x; equation connect(bus.one.used, u); x = u; end Reader;
  model Model "Four buses, connected as a whole"
    Bus bus, other; Source source; Reader reader;
  equation
    connect(bus, source.bus); connect(bus, reader.bus); connect(bus, other);
  end Model;
end Buses;
"""


def test_members_of_buses_that_are_only_connected_with_each_other_do_not_exist() -> None:
    model = load(BUSES, "Buses.Model")
    paths = {leaf.path for leaf in leaves_of(model)}
    assert "other.one.used" in paths
    assert not [path for path in paths if path.rpartition(".")[2] in ("unused", "flag", "idle")]
    assert structure(model).variables == len(paths)


LOOP = """
package Loops
  record Orientation
    Real t[2];
    function equalityConstraint
      input Orientation a, b;
      output Real residue[1] = {a.t[1] - b.t[1]};
    algorithm
    end equalityConstraint;
  end Orientation;
  connector Frame Orientation R; flow Real f; end Frame;
  model World Frame a; equation a.R.t = {time, 2}; Connections.root(a.R); end World;
  model Rod
    Frame a, b;
    Real turn;
  equation
    Connections.branch(a.R, b.R);
    b.R.t = a.R.t + {turn, 0};
    a.f + b.f = 0;
  end Rod;
  model Model "The loop determines the turn of one rod, and the force in the other is given"
    World world; Rod first, second;
  equation
    connect(world.a, first.a); connect(world.a, second.a); connect(first.b, second.b);
    first.turn = 3;
    first.a.f = 5;
  end Model;
end Loops;
"""


def test_a_loop_of_frames_is_closed_by_the_residue_of_their_orientations() -> None:
    sol = simulate(load(LOOP, "Loops.Model"), 1.0, save="end")
    assert sol["second.turn"][-1] == pytest.approx(3.0)
    assert sol["second.b.R.t"][-1] == pytest.approx([4.0, 2.0])
    assert sol["world.a.f"][-1] == pytest.approx(0.0)

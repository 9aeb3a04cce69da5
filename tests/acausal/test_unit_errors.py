"""Units of whole models: what is reported, where, and how to silence it."""

from typing import Any, Self

import jax.numpy as jnp
import pytest

from acausal import (
    ROW,
    Array,
    Component,
    Connections,
    Discrete,
    Energy,
    Equations,
    Events,
    ModelError,
    Param,
    Requirements,
    Scalar,
    Time,
    UnitError,
    Var,
    Vector,
    at,
    choose_states,
    connect,
    eq,
    ifelse,
    initialise,
    refuse,
    remember,
    repeat,
    require,
    segment,
    shape,
    simulate,
    structure,
    when,
)
from acausal._reduce.flatten import flatten
from acausal._unit_check.model_units import check_units, unit_problems
from components import blocks, hydraulic
from components.blocks import Gain, Input, Output, Ramp, Sum
from components.rotational import AngleSensor, ConstantTorque, Inertia, SignalTorque, SpeedSensor, TorqueSensor


class Wrong(Component):
    """Several mistakes."""

    J: Param[Scalar, "kg.m2"]
    k: Param[Scalar, "N.m/A"]
    i: Var[Scalar, "A"] = 0.0
    w: Var[Scalar, "rad/s"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(
            newton=eq(self.J * d.w, self.k * self.i - self.w),
            law=eq(self.i, self.w),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w, dissipated=self.k * self.i * self.w)


class Compared(Component):
    """Conditions that compare a length with a pressure and with times; the last one is not to be checked."""

    p: Param[Scalar, "Pa"] = 1.0
    times: Param[Vector, "s"] = (1.0, 2.0)
    v: Param[Scalar, "m/s"] = 1.0
    x: Var[Scalar, "m"] = 0.0
    y: Var[Scalar, "m"] = 0.0
    z: Var[Scalar, "m"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            relation=eq(d.x, ifelse(self.x > self.p, self.v, 2.0 * self.v)),
            table=eq(d.y, self.v * segment(self.y, self.times)),
            silent=eq(d.z, ifelse(self.z > self.p, self.v, 2.0 * self.v), check_units=False),
        )


def test_conditions_are_checked() -> None:
    assert [problem.partition(": ")[2] for problem in unit_problems(flatten(Compared()))] == [
        "compares self.x in m with self.p in Pa (kg/(m.s2)).",
        "compares self.y in m with self.times in s.",
    ]


class Happening(Component):
    """Events whose units do not agree, each in one place."""

    p: Param[Scalar, "s"] = 60.0
    every: Param[Scalar, "m"] = 1.0
    T: Var[Scalar, "K"] = 300.0
    v: Var[Scalar, "m/s"] = 1.0
    s: Var[Scalar, "m"] = 0.0
    past: Discrete[Vector, "", shape("n", ROW)] = -jnp.inf
    t: Time[Scalar, "s"] = 0.0
    n: int = 4

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.s, self.v), rest=eq(d.v, 0.0), still=eq(d.T, 0.0))

    def requirements(self) -> Requirements:
        return (require(self.p > self.every, "p must be above every"), require(self.p < 1e9, "p must be below 1e9"))

    def events(self) -> Events:
        return dict(
            condition=when(self.p < self.T, v=0.0),
            value=when(self.s > self.v * self.t, s=self.T),
            time=at(self.every, v=2.0 * self.v),
            clock=at(0.5, every=self.every, v=2.0 * self.v),
            reason=refuse(self.s > self.T, "cold"),
            literal=when(self.s > 0.5, v=-0.1, s=self.s + 0.2),
            silent=when(self.p < self.T, check_units=False, s=self.T),
            memory=remember(self.every, past=self.s + self.T),
            fine=when((self.s > self.v * self.p) & (jnp.inf > self.T), v=-0.5 * self.v),
        )


def test_events_and_requirements_are_checked() -> None:
    found = [problem.removeprefix("Happening, ") for problem in unit_problems(flatten(Happening()))]
    assert found == [
        "requirement 'p must be above every': compares self.p in s with self.every in m.",
        "event condition: compares self.p in s with self.T in K.",
        "event value: sets self.s in m to self.T in K.",
        "event time: takes self.every in m as a time, which should be in s.",
        "event clock: takes self.every in m as a time, which should be in s.",
        "event reason: compares self.s in m with self.T in K.",
        "event memory: takes self.every in m as a time, which should be in s.",
        "event memory: adds self.s in m to self.T in K.",
    ]


class Plant(Component):
    """A part whose events a composite states."""

    T: Var[Scalar, "K"] = 300.0
    s: Var[Scalar, "m"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(heat=eq(d.T, 0.0), rest=eq(d.s, 0.0))


class Supervised(Component):
    plant: Plant = Plant()
    limit: Param[Scalar, "Pa"] = 1.0

    def events(self) -> Events:
        return {"shut": when(self.limit < self.plant.T, **{"plant.s": 2.0 * self.plant.T})}


def test_events_of_composites_are_checked() -> None:
    with pytest.raises(UnitError, match=r"Supervised \(parts\[\]\), event shut: compares"):
        simulate(Many(parts=repeat(Supervised(), 2)), 1.0)
    assert [problem.partition(", ")[2] for problem in unit_problems(flatten(Supervised()))] == [
        "event shut: compares self.limit in Pa (kg/(m.s2)) with self.plant.T in K.",
        "event shut: sets self.plant.s in m to 2 * self.plant.T in K.",
    ]


class Many(Component):
    parts: Array[Supervised]


def test_stop_conditions_and_conditions_at_the_start_are_checked() -> None:
    plant = Plant()
    with pytest.raises(UnitError, match=r"until do not agree: it subtracts s\.s in m from s\.T in K"):
        simulate(plant, 1.0, until=lambda s: s.T - s.s)
    assert simulate(plant, 1.0, until=lambda s: s.T + 1e-3 * s.s - 299.0, throw=False).t1 > 0.0
    with pytest.raises(UnitError, match=r"conditions do not agree: it subtracts s\.s in m from s\.T in K"):
        initialise(plant, lambda s, d: dict(odd=eq(s.T, s.s)), free="all")
    with pytest.raises(UnitError, match=r"it subtracts s\.T in K from d\.T in K/s"):
        initialise(plant, lambda s, d: dict(odd=eq(d.T, s.T)), free="all")
    start = initialise(plant, lambda s, d: dict(odd=eq(s.T, s.s, check_units=False)), free="s")
    assert start.s == pytest.approx(float(start.T), abs=1e-9)


class Pair(Component):
    first: Wrong
    second: Wrong

    def connections(self) -> Connections:
        return ()


def test_all_mistakes_are_listed_with_their_place() -> None:
    wrong = Wrong(J=1.0, k=1.0)
    with pytest.raises(UnitError) as caught:
        choose_states(Pair(first=wrong, second=wrong))
    assert str(caught.value).splitlines()[:-1] == [
        "The units of the model do not agree.",
        "  Wrong (first and 1 more), equation newton: subtracts self.w in rad/s (1/s) from self.k * self.i in N.m "
        "(kg.m2/s2).",
        "  Wrong (first and 1 more), equation law: equates self.i in A with self.w in rad/s (1/s).",
        "  Wrong (first and 1 more), energy: states stored as 0.5 * self.J * self.w in N.m.s (kg.m2/s), which should "
        "be in J (kg.m2/s2).",
    ]
    assert str(caught.value).splitlines()[-1].startswith("  Remedy: ")


def test_a_model_without_parts_is_named_by_its_class() -> None:
    assert unit_problems(flatten(Wrong(J=1.0, k=1.0)))[1].startswith("Wrong, equation law: ")


def test_members_of_an_array_are_named() -> None:
    problems = unit_problems(flatten(Holder(part=repeat(Wrong(J=1.0, k=1.0), 3))))
    assert problems[1].startswith("Wrong (part[0] and 2 more), equation law: ")


class Holder(Component):
    part: Component


class Accounted(Component):
    """A composite with an energy account for its parts."""

    rotor: Inertia
    more: Array[Inertia]

    def connections(self) -> Connections:
        return ()

    def energy(self) -> Energy:
        return Energy(stored=self.rotor.J * self.rotor.w**2, dissipated=jnp.sum(self.more.item.J * self.more.item.w))


def test_energy_of_a_composite() -> None:
    composite = Accounted(rotor=Inertia(J=1.0), more=repeat(Inertia(J=1.0), 2))
    expected = (
        "energy: states dissipated as sum(self.more[].J * self.more[].w) in N.m.s (kg.m2/s), which should be in W "
        "(kg.m2/s3)."
    )
    assert unit_problems(flatten(composite)) == [f"Accounted, {expected}"]
    assert unit_problems(flatten(Holder(part=composite))) == [f"Accounted (part), {expected}"]
    assert unit_problems(flatten(Holder(part=repeat(composite, 3)))) == [f"Accounted (part[]), {expected}"]


class Rates(Component):
    """Derivatives, the time, and arrays."""

    n: int
    tau: Param[Scalar, "s"]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Vector, "m", shape("n")] = 0.0  # pyright: ignore[reportAssignmentType]
    v: Var[Vector, "m/s", shape("n")] = 0.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(self.v, d.x), decay=eq(self.tau * d.v, -self.v * jnp.exp(-self.t / self.tau)))


def test_derivatives_have_their_unit_per_second() -> None:
    assert unit_problems(flatten(Rates(n=3, tau=1.0))) == []


class Declared(Component):
    angle: Param[Scalar, "deg"]
    torque: Param[Scalar, "Nm"]
    x: Var[Scalar, "rad"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(self.x, self.angle))


def test_declared_units_must_be_known_and_si() -> None:
    assert unit_problems(flatten(Declared(angle=1.0, torque=1.0))) == [
        "Declared, declaration of angle: the unit 'deg' is not coherent with SI: declare 'rad' and give values by "
        "quantity(..., 'deg').",
        "Declared, declaration of torque: the unit 'Nm' is not known: newton metre is N.m. Did you mean N/m or N.m or "
        "m?",
    ]


class Empirical(Component):
    """A law between numbers."""

    T: Var[Scalar, "K"] = 300.0
    mu: Var[Scalar, "Pa.s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(walther=eq(jnp.log(self.mu), 3.0 - 0.01 * self.T, check_units=False), cooling=eq(d.T))


def test_what_is_not_checked_is_listed() -> None:
    model = Holder(part=Empirical())
    assert unit_problems(flatten(model)) == []
    report = structure(model)
    assert report.unchecked == ("part.walther",)
    assert "Units not checked (1): part.walther" in str(report)
    assert structure(_drive(TorqueSensor())).unchecked == ()


class Misled(Component):
    """An equation that is told neither to check its units nor not to."""

    x: Var[Scalar, "m"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x, check_units="no"))  # pyright: ignore[reportArgumentType]


def test_whether_to_check_is_true_or_false() -> None:
    with pytest.raises(ModelError, match=r"Misled\.equations: decay .* check_units='no'; it must be True or False"):
        structure(Misled())


class Loop(Component):
    """A sensor whose signal goes to a drive."""

    drive: ConstantTorque
    sensor: AngleSensor | SpeedSensor | TorqueSensor
    block: Component
    torque: SignalTorque
    rotor: Inertia

    def connections(self) -> Connections:
        sensor, block = self.sensor, self.block
        assert isinstance(block, Gain | Limiter | Integrator)
        if isinstance(sensor, TorqueSensor):
            mechanics = connect(self.drive.flange, sensor.a), connect(sensor.b, self.rotor.a)
        else:
            mechanics = (connect(self.drive.flange, sensor.flange, self.rotor.a),)
        return (
            *mechanics,
            connect(sensor.y, block.u),
            connect(block.y, self.torque.u),
            connect(self.torque.flange, self.rotor.b),
        )


class Limiter(Component):
    """y = u within limits."""

    most: Param[Scalar, ""]
    u: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(limit=eq(self.y.value, jnp.clip(self.u.value, -self.most, self.most)))


class Integrator(Component):
    """dy/dt = u."""

    u: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(integral=eq(d.y.value, self.u.value))


def _drive(sensor: Any, block: Component | None = None) -> Loop:
    return Loop(
        drive=ConstantTorque(torque=1.0),
        sensor=sensor,
        block=block or Limiter(most=1.0),
        torque=SignalTorque(),
        rotor=Inertia(J=1.0),
    )


def test_a_signal_of_the_right_quantity() -> None:
    assert unit_problems(flatten(_drive(TorqueSensor()))) == []


def test_a_signal_of_another_quantity() -> None:
    """The limiter passes the speed on, so that it would drive with a speed for a torque."""
    (problem,) = unit_problems(flatten(_drive(SpeedSensor())))
    assert problem == (
        "These signals are connected, but carry different quantities: "
        "sensor.y.value is in 1/s, torque.u.value is in N.m "
        "(kg.m2/s2)."
    )
    with pytest.raises(UnitError, match=r"sensor\.y\.value is in 1/s, torque\.u\.value is in N\.m"):
        check_units(flatten(_drive(SpeedSensor())))


@pytest.mark.parametrize("block", [Gain(k=3.0), Integrator()])
def test_a_gain_has_any_unit(block: Component) -> None:
    assert unit_problems(flatten(_drive(SpeedSensor(), block))) == []


class Banks(Component):
    """Arrays of sensors and drives, joined member by member by way of a port of a composite."""

    sensors: Array[Any]
    drives: Array[SignalTorque]
    outer: Output = Output()

    def connections(self) -> Connections:
        return connect(self.sensors[:].y, self.drives[:].u), connect(self.sensors[0].y, self.outer)


def test_arrays_of_signals() -> None:
    wrong = Banks(sensors=repeat(AngleSensor(), 2), drives=repeat(SignalTorque(), 2))
    problems = unit_problems(flatten(wrong))
    assert len(problems) == 2
    assert "drives[1].u.value is in N.m (kg.m2/s2)" in problems[1]
    right = Banks(sensors=repeat(TorqueSensor(), 2), drives=repeat(SignalTorque(), 2))
    assert unit_problems(flatten(right)) == []


class Valve(Component):
    """A ramp and a clock for a valve that wants a number."""

    source: Component
    valve: hydraulic.OnOffValve

    def connections(self) -> Connections:
        assert isinstance(self.source, blocks.Clock | Ramp)
        return (connect(self.source.y, self.valve.u),)


def test_a_number_is_wanted() -> None:
    valve = hydraulic.OnOffValve(area=1e-6, density=850.0)
    assert unit_problems(flatten(Valve(source=Ramp(height=1.0, duration=1.0), valve=valve))) == []
    (problem,) = unit_problems(flatten(Valve(source=blocks.Clock(), valve=valve)))
    assert "source.y.value is in s" in problem
    assert "valve.u.value is in 1" in problem


class Weighted(Component):
    """Sums whose weights have units too."""

    angle: AngleSensor
    speed: SpeedSensor
    sum: Sum
    torque: SignalTorque

    def connections(self) -> Connections:
        return (
            connect(self.angle.y, self.sum.u1),
            connect(self.speed.y, self.sum.u2),
            connect(self.sum.y, self.torque.u),
        )


def test_a_controller_with_gains() -> None:
    model = Weighted(angle=AngleSensor(), speed=SpeedSensor(), sum=Sum(k1=2.0, k2=0.1), torque=SignalTorque())
    assert unit_problems(flatten(model)) == []

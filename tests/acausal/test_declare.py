"""Declarations in class statements, and those that are refused."""

import math
import pickle
import sys
from typing import Any, ClassVar, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc
from _postponed import Friend, Postponed

from acausal import (
    ArgumentError,
    Component,
    Connections,
    Discrete,
    Equations,
    Flow,
    ModelError,
    Param,
    ParameterError,
    Port,
    Record,
    Scalar,
    StructureError,
    Time,
    Var,
    Vector,
    connect,
    eq,
    nonnegative,
    positive,
    replace,
    shape,
    simulate,
)
from acausal._declare.fields import dynamic_fields
from acausal._declare.node import leaves_of, nodes_of
from components.electrical import Resistor
from components.rotational import ConstantSpeed, ConstantTorque, Damper, EccentricDisc, Fixed, Inertia
from components.translational import Mass


class Lid(Port):
    p: Var[Scalar, "Pa"] = 0.0
    q: Flow[Scalar, "m3/s"] = 0.0


class Law(Record):
    power: Param[Scalar, "1"] = 2


class Tank(Component):
    """One leaf of each role, two static fields, a port and two parts that may be missing."""

    unit: ClassVar[str] = "litre"

    k: Param[Scalar, "1/s", positive]
    weights: Param[Vector, "1", nonnegative] = (1, 2)  # pyright: ignore[reportAssignmentType]
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "m"] = 1
    profile: Var[Vector, "m", shape("n", 2)] = 0.0  # pyright: ignore[reportAssignmentType]
    n: int = 3
    name: str = "tank"
    lid: Lid = Lid()
    law: Law | None = None
    pair: tuple[Law, ...] = ()

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.x), flat=eq(self.profile))


def test_roles_of_leaves() -> None:
    tank = Tank(k=2, law=Law(), pair=(Law(power=3), Law(power=4)))
    found = {leaf.path: (leaf.declaration.role, leaf.declaration.unit, leaf.sizes) for leaf in leaves_of(tank)}
    assert found == {
        "k": ("param", "1/s", ()),
        "weights": ("param", "1", None),
        "t": ("time", "s", ()),
        "x": ("var", "m", ()),
        "profile": ("var", "m", (3, 2)),
        "lid.p": ("var", "Pa", ()),
        "lid.q": ("flow", "m3/s", ()),
        "law.power": ("param", "1", ()),
        "pair[0].power": ("param", "1", ()),
        "pair[1].power": ("param", "1", ()),
    }
    assert [float(value) for value in jax.tree_util.tree_leaves(tank)[-3:]] == [2.0, 3.0, 4.0]


def test_what_a_class_starts_from_is_not_given() -> None:
    """A start value is a leaf where the model gives it, zero included; else the class says where to start."""
    starts = {leaf.path: (leaf.value, leaf.declaration.start) for leaf in leaves_of(Tank(k=2, x=0.0))}
    assert starts["x"] == (0.0, 1.0)
    assert starts["lid.p"] == (None, 0.0)
    assert replace(Tank(k=2), {"x": 0.5}).x == 0.5
    assert replace(Tank(k=2, x=0.5), {"x": None}).x is None


def test_a_missing_part_has_no_leaves() -> None:
    assert {leaf.path.partition(".")[0] for leaf in leaves_of(Tank(k=2))} == {
        "k",
        "weights",
        "t",
        "x",
        "profile",
        "lid",
    }


def test_parameters_become_float_arrays() -> None:
    tank = Tank(k=2, weights=np.array([1, 2]))
    for value in (tank.k, tank.weights):
        assert isinstance(value, jax.Array)
        assert value.dtype == jnp.float64
    np.testing.assert_array_equal(tank.weights, [1.0, 2.0])


@pytest.mark.parametrize("start", [1, True, 1.0])
def test_a_start_value_given_as_a_number_is_a_python_float(start: Any) -> None:
    assert type(Tank(k=2, x=start).x) is float


def test_a_start_value_given_as_an_array_stays_an_array() -> None:
    x = Tank(k=2, x=jnp.asarray(1)).x
    assert isinstance(x, jax.Array)
    assert x.dtype == jnp.float64


def test_static_fields_are_structure() -> None:
    structure = jax.tree_util.tree_structure
    assert structure(Tank(k=2)) == structure(Tank(k=3))
    assert structure(Tank(k=2)) != structure(Tank(k=2, name="barrel"))
    assert Tank.unit == "litre"
    assert "unit" not in {name for name, _ in dynamic_fields(Tank)}


def test_fields_are_keyword_only() -> None:
    with pytest.raises(TypeError):
        Tank(2.0)  # pyright: ignore[reportCallIssue]
    with pytest.raises(TypeError, match="k"):
        Tank()  # pyright: ignore[reportCallIssue]


class Shared(Component, partial=True):
    gain: Param[Scalar, "1"] = 1.0
    x: Var[Scalar, "m"] = 1.0


def test_a_partial_component_cannot_be_built() -> None:
    with pytest.raises(ModelError, match=r"Shared is partial.*derive"):
        Shared()


def test_a_final_component_cannot_be_derived_from() -> None:
    with pytest.raises(ModelError, match=r"(?s)Bigger derives from Tank, which is final.*partial=True"):

        class Bigger(Tank):
            pass

    with pytest.raises(ModelError, match=r"Use Fan as a part, derive from Shared as Fan does, or move"):

        class BiggerFan(Fan):
            pass


class Fan(Shared):
    def equations(self, d: Any) -> Equations:
        return dict(rest=eq(d.x))


class Train(Component):
    drive: ConstantTorque
    load: Inertia

    def connections(self) -> Connections:
        return (connect(self.drive.flange, self.load.a),)


class BrakedTrain(Train):
    """More parts."""

    brake: Damper
    wall: Fixed

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.load.b, self.brake.a),
            connect(self.brake.b, self.wall.flange),
        )


class GivenTrain(BrakedTrain):
    """A part of another class, in a variant of a variant."""

    drive: ConstantSpeed  # pyright: ignore[reportIncompatibleVariableOverride]


def test_a_class_that_only_joins_parts_can_be_varied() -> None:
    load, brake, wall = Inertia(J=2.0), Damper(d=3.0), Fixed()
    braked = BrakedTrain(drive=ConstantTorque(torque=1.0), load=load, brake=brake, wall=wall)
    assert simulate(braked, 1.0, save="end").final.load.w == pytest.approx((1 - math.exp(-1.5)) / 3.0, rel=1e-6)
    given = GivenTrain(drive=ConstantSpeed(speed=4.0), load=load, brake=brake, wall=wall)
    assert abs(simulate(given, 1.0, save="end").final.brake.tau) == pytest.approx(12.0, rel=1e-9)
    with pytest.raises(ModelError, match=r"Bare\.load replaces a port or part of Train"):

        class Bare(Train):
            load: Param[Scalar, "kg.m2"]  # pyright: ignore[reportIncompatibleVariableOverride]


@pytest.mark.parametrize("kind", [Param, Var, Flow, Time, Discrete])
def test_a_declaration_without_type_and_unit(kind: Any) -> None:
    """It is no constant of a type of that name."""
    metaclass: Any = type(Component)
    with pytest.raises(ArgumentError, match=r"Bare\.x lacks its type and its unit: .*Scalar, 'ohm'"):
        metaclass("Bare", (Component,), {"__module__": __name__, "__annotations__": {"x": kind}, "x": 0.0})


def test_override_without_annotation() -> None:
    with pytest.raises(ModelError, match=r"Doubled\.gain overrides.*annotate it again"):

        class Doubled(Shared):
            gain = 2.0  # pyright: ignore[reportAssignmentType]


def test_override_with_annotation() -> None:
    class Doubled(Shared):
        gain: Param[Scalar, "1"] = 2.0

    assert float(Doubled().gain) == 2.0


def test_parts_in_a_field_that_is_not_declared_to_hold_any() -> None:
    class Bag(Component):
        items: tuple

    refused = pytest.raises(ModelError, match=r"Bag\.items\[0\] holds \w+, but does not declare it(?s:.*)tuple\[")
    # Equinox warns of the array before, which is less than an error.
    with refused, pytest.warns(UserWarning, match="set as static"):
        Bag(items=(Law(),))


def test_a_port_is_not_replaced_by_something_else() -> None:
    class Joined(Component, partial=True):
        law: Law

    with pytest.raises(ModelError, match=r"Numbered\.law replaces a port or part of Joined"):

        class Numbered(Joined):
            law: Param[Scalar, "1"] = 1.0  # pyright: ignore[reportIncompatibleVariableOverride]


def test_a_model_without_variables() -> None:
    class Nothing(Component):
        pass

    with pytest.raises(StructureError, match="no variables: give it components"):
        simulate(Nothing(), 1.0)


def test_default_that_holds_parameters() -> None:
    with pytest.raises(ModelError, match=r"Holder\.law has a default with parameters.*(?s:.*)Create it in"):

        class Holder(Component):
            law: Law = Law()


def test_array_variable_without_shape() -> None:
    with pytest.raises(ModelError, match=r"Formless\.x is an array variable: declare its shape"):

        class Formless(Component):
            x: Var[Vector, "m"] = 0.0  # pyright: ignore[reportAssignmentType]


def test_annotation_without_unit() -> None:
    with pytest.raises(ArgumentError, match="takes a type and a unit"):
        Param[Scalar]  # pyright: ignore[reportInvalidTypeArguments]
    with pytest.raises(ArgumentError, match="unit"):
        Param[Scalar, 3.0]


def test_annotation_with_unknown_option() -> None:
    with pytest.raises(ArgumentError, match=r"Unknown option 'large'.*positive"):
        Var[Scalar, "m", "large"]


@pytest.mark.filterwarnings("ignore:A JAX array is being set as static")  # equinox, before we can say it better
@pytest.mark.parametrize("value", [jnp.ones(2), np.ones(2), Law()], ids=["jax", "numpy", "part"])
def test_static_field_that_holds_an_array_or_a_part(value: Any) -> None:
    with pytest.raises(ModelError, match=r"Tank\.name holds .*annotate"):
        Tank(k=2, name=value)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Mass(m=-1.0), r"Mass\.m must be positive and finite, got -1\.0 kg"),
        (lambda: Mass(m=0.0), r"Mass\.m must be positive and finite, got 0\.0 kg"),
        (lambda: Mass(m=float("nan")), r"Mass\.m must be positive and finite, got nan"),
        (lambda: Resistor(R=-2.0), r"Resistor\.R must be nonnegative .*NegativeResistor.*, got -2\.0 ohm"),
        (lambda: Tank(k=1.0, weights=jnp.array([1.0, -1.0])), r"Tank\.weights must be nonnegative"),
        (lambda: Postponed(k=-1.0), r"Postponed\.k must be positive"),
    ],
)
def test_parameter_outside_its_range(build: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        build()


def test_bound_itself_is_admitted_where_it_is_closed() -> None:
    assert float(Resistor(R=0.0).R) == 0.0


def test_postponed_annotations() -> None:
    model = Postponed(k=2, friend=Friend())
    assert [leaf.path for leaf in leaves_of(model)] == ["k", "x", "friend.y"]
    assert [leaf.declaration.role for leaf in leaves_of(model)] == ["param", "var", "var"]
    assert Postponed(k=2).n == 3
    assert isinstance(model.k, jax.Array)


def test_pickle() -> None:
    model = rc(v0=0.5)
    copy = pickle.loads(pickle.dumps(model))
    assert jax.tree_util.tree_structure(copy) == jax.tree_util.tree_structure(model)
    assert jax.tree_util.tree_leaves(copy) == jax.tree_util.tree_leaves(model)


def test_tree_at_changes_one_leaf() -> None:
    model = rc()
    changed = eqx.tree_at(lambda m: m.r.R, model, 7.0)
    assert changed.r.R == 7.0
    assert model.r.R == 100.0
    assert changed.c.C == model.c.C


def test_a_model_is_flattened_with_one_call_for_each_node() -> None:
    model, calls = rc(), []

    def note(frame: Any, event: str, _: object) -> None:
        if event == "call":
            calls.append(frame.f_code.co_name)

    sys.setprofile(note)
    try:
        jax.tree_util.tree_flatten(model)
    finally:
        sys.setprofile(None)
    assert calls == ["tree_flatten"] + ["flatten"] * len(list(nodes_of(model)))


def test_a_method_of_a_component_can_be_compiled() -> None:
    profile = EccentricDisc(eccentricity=0.01, radius=0.02)
    np.testing.assert_allclose(jax.jit(profile.lift)(1.0), profile.lift(1.0))
    np.testing.assert_allclose(eqx.filter_jit(profile.lift)(1.0), profile.lift(1.0))


def test_gradient_skips_start_values_given_as_numbers() -> None:
    gradient = eqx.filter_grad(lambda tank: tank.k**2 * tank.x)(Tank(k=3.0, x=2.0))
    assert gradient.x is None
    np.testing.assert_allclose(gradient.k, 12.0)


@pytest.mark.thorough
def test_gradient_by_a_start_value_given_as_an_array() -> None:
    def at_end(model: Any) -> Any:
        return simulate(model, 0.1, save="end", rtol=1e-10).final.c.v

    gradient = eqx.filter_grad(at_end)(rc(v0=jnp.asarray(1.0)))
    np.testing.assert_allclose(gradient.c.v, np.exp(-1.0), rtol=1e-8)


class Wrong(Component):
    k: Param[Scalar, "1"] = 1.0
    x: Var[Scalar, "m"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -d.k * self.x))


def test_derivative_of_a_parameter() -> None:
    with pytest.raises(ModelError, match=r"Wrong\.equations uses d\.k, but k is a parameter.*Var"):
        simulate(Wrong(), 1.0)


class Unnamed(Component):
    x: Var[Scalar, "m"] = 1.0

    def equations(self, d: Self) -> Equations:
        return [eq(d.x, -self.x)]  # pyright: ignore[reportReturnType]


def test_equations_without_names() -> None:
    with pytest.raises(ModelError, match=r"Unnamed\.equations must return a dictionary.*got list"):
        simulate(Unnamed(), 1.0)


@pytest.mark.parametrize("wrong", [0.2, "a", np.ones(2), (Lid(), 1.0)])
def test_what_is_no_part_is_refused_where_a_part_belongs(wrong: Any) -> None:
    with pytest.raises(ArgumentError, match=r"Tank\.lid(\[1\])? must be a component, a port or a record, got"):
        Tank(n=1, k=1.0, lid=wrong)

"""Variables that are equal up to the sign."""

from typing import Any, Self

import jax.numpy as jnp
import pytest

from acausal import Component, Equations, Nominal, Scalar, StructureError, Var, eq, prefer, structure
from acausal._reduce.aliases import ZERO, merge
from acausal._reduce.flatten import flatten


class Web(Component):
    """Four variables between which the named equations hold."""

    law: str
    a: Var[Scalar, "m"] = 0.0
    b: Var[Scalar, "m"] = 0.0
    c: Var[Scalar, "m", prefer] = 0.0
    e: Var[Scalar, "m", Nominal(2.0)] = 0.0

    def equations(self, d: Self) -> Equations:
        return LAWS[self.law](self)


LAWS: dict[str, Any] = {
    "equal": lambda s: dict(one=eq(s.a, s.b)),
    "opposite": lambda s: dict(one=eq(s.a, -s.b)),
    "sum": lambda s: dict(one=eq(s.a + s.b)),
    "scaled": lambda s: dict(one=eq(3.0 * s.a, 3.0 * s.b)),
    "chain": lambda s: dict(one=eq(s.a, -s.b), two=eq(s.b, -s.c), three=eq(s.e, -s.c)),
    "self": lambda s: dict(one=eq(s.a, -s.a)),
    "own opposite": lambda s: dict(one=eq(s.a, s.b), two=eq(s.b, -s.a)),
    "odd loop": lambda s: dict(one=eq(s.a, s.b), two=eq(s.b, s.c), three=eq(s.c, -s.a)),
    "zero": lambda s: dict(one=eq(s.b), two=eq(s.b, s.c)),
    "zero factor": lambda s: dict(one=eq(s.b), two=eq(s.b * s.e, s.c, check_units=False)),
    "zero factors in turn": lambda s: dict(
        one=eq(s.e * s.b, s.c, check_units=False), two=eq(s.b, s.a * jnp.sin(s.e), check_units=False), three=eq(s.a)
    ),
    "zero divided": lambda s: dict(one=eq(s.a), two=eq(s.b, s.a / s.e + s.c, check_units=False)),
    "unequal": lambda s: dict(one=eq(s.a, 2.0 * s.b)),
    "shifted": lambda s: dict(one=eq(s.a, s.b + 1.0)),
    "of three": lambda s: dict(one=eq(s.a + s.b, s.c)),
    "even loop": lambda s: dict(one=eq(s.a, s.b), two=eq(s.b, s.c), three=eq(s.c, s.a)),
    "twice": lambda s: dict(one=eq(s.a, -s.b), two=eq(s.a + s.b)),
    "zero twice": lambda s: dict(one=eq(s.a), two=eq(s.b), three=eq(s.a, s.b)),
}


def merged(law: str) -> tuple[dict[str, tuple[str, int]], int]:
    """The variable that replaces each other variable, with its sign, and the number of equations that are left."""
    flat = flatten(Web(law=law))
    result = merge(flat)
    found = {}
    for node in range(flat.n_nodes):
        representative = int(result.representative[node])
        if representative == ZERO:
            found[flat.node_name(node)] = ("0", 0)
        elif representative != node:
            found[flat.node_name(node)] = (flat.node_name(representative), int(result.sign[node]))
        else:
            assert result.sign[node] == 1
    return found, sum(len(family.members) for family in result.families)


@pytest.mark.parametrize(("law", "sign"), [("equal", 1), ("opposite", -1), ("sum", -1), ("scaled", 1)])
def test_pair(law: str, sign: int) -> None:
    found, left = merged(law)
    assert found in ({"b": ("a", sign)}, {"a": ("b", sign)})
    assert left == 0


def test_chain_is_replaced_by_the_preferred_variable() -> None:
    assert merged("chain") == ({"a": ("c", 1), "b": ("c", -1), "e": ("c", -1)}, 0)


@pytest.mark.parametrize(("law", "names"), [("self", "a"), ("own opposite", "ab"), ("odd loop", "abc"), ("zero", "bc")])
def test_what_equals_its_opposite_vanishes(law: str, names: str) -> None:
    assert merged(law) == (dict.fromkeys(names, ("0", 0)), 0)


@pytest.mark.parametrize(("law", "names"), [("zero factor", "bc"), ("zero factors in turn", "abc")])
def test_product_with_zero_vanishes(law: str, names: str) -> None:
    assert merged(law) == (dict.fromkeys(names, ("0", 0)), 0)


def test_sum_with_a_zero_product_is_an_alias() -> None:
    assert merged("zero divided") == ({"a": ("0", 0), "b": ("c", 1)}, 0)


class Stage(Component):
    """A resistor from a source to a node, whose capacitance is computed, and is zero."""

    C: Var[Scalar, "F"] = 0.0
    v: Var[Scalar, "V"] = 0.0
    i: Var[Scalar, "A"] = 0.0
    source: Var[Scalar, "V"] = 2.0

    def equations(self, d: Self) -> Equations:
        return dict(
            capacitance=eq(self.C, 0.0 * self.C),
            charge=eq(self.i, self.C * d.v),
            resistor=eq(self.source - self.v, self.i, check_units=False),
            decay=eq(d.source, -self.source, check_units=False),
        )


def test_factor_zero_of_a_derivative_leaves_no_state() -> None:
    report = structure(Stage())
    assert list(report.states) == ["source"]
    assert not report.blocks[-1].tearing


@pytest.mark.parametrize("law", ["unequal", "shifted", "of three"])
def test_other_equations_stay(law: str) -> None:
    assert merged(law) == ({}, 1)


@pytest.mark.parametrize(("law", "culprit"), [("even loop", "three"), ("twice", "two"), ("zero twice", "three")])
def test_repeated_equation(law: str, culprit: str) -> None:
    with pytest.raises(StructureError, match=rf"(?s)equation {culprit} only repeats.*connect a component that fixes"):
        merged(law)

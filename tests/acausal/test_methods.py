"""Methods of components that cannot be traced, or that state what never happens: each is refused with its remedy."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import pytest

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    Var,
    at,
    eq,
    refuse,
    simulate,
    when,
)


class Rising(Component):
    """x = t, with the events that a function states."""

    stated: Callable[[Any], Any]
    x: Var[Scalar, ""] = 0.0
    mode: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(rise=eq(d.x, 1.0, check_units=False))

    def events(self) -> Events:
        return self.stated(self)


class Holder(Component):
    part: Component


# What the types of `when` and `at` do not admit.
RELATIONS: Any = lambda s: [s.x > 0.2, s.x > 0.3]  # noqa: E731
TIMES: Any = lambda s: [0.25, s.mode + 0.5]  # noqa: E731
TEXT: Any = "x > 1"
EMPTY: Any = []

BAD_EVENTS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "and": (lambda s: dict(e=when(s.x > 0.2 and s.x < 0.5, mode=1.0)), r"part\.events needs .* by &, \| and ~ instead"),
    "or": (lambda s: dict(e=when(s.x > 0.2 or s.x < 0.5, mode=1.0)), r"part\.events needs .* by &, \| and ~ instead"),
    "not": (lambda s: dict(e=when(not s.x > 0.2, mode=1.0)), r"part\.events needs .* by &, \| and ~ instead"),
    "if": (lambda s: dict(e=when(s.x > (1.0 if s.mode else 2.0), mode=1.0)), "instead of `if`"),
    "float": (lambda s: dict(e=when(float(s.x) > 1.0, mode=1.0)), "part.events needs the number of a variable"),
    "True": (lambda s: dict(e=when(True, mode=1.0)), "part.events: e has a bool as its condition"),
    "False": (lambda s: dict(e=refuse(False, "no")), "part.events: e has a bool as its condition"),
    "list": (lambda s: dict(e=when(RELATIONS(s), mode=1.0)), "part.events: e has a list as its condition"),
    "text": (lambda s: dict(e=when(TEXT, mode=1.0)), "part.events: e has a str as its condition"),
    "array": (lambda s: dict(e=when(s.x > jnp.arange(2.0), mode=1.0)), r"condition of shape \(2,\)"),
    "no time": (lambda s: dict(e=at(EMPTY, mode=1.0)), "part.events: e has no time"),
    "no times": (lambda s: dict(e=at(s.mode + jnp.zeros(0), mode=1.0)), "part.events: e has no time"),
    "every below zero": (
        lambda s: dict(e=at(0.1, every=-0.1, mode=1.0)),
        r"every -0\.1 s: `every` must be positive",
    ),
    "every zero": (lambda s: dict(e=at(0.1, every=0.0, mode=1.0)), "`every` must be positive"),
    "equal": (lambda s: dict(e=when(s.x == 0.5, mode=1.0)), "part.events: e tests real numbers for equality"),
    "unequal": (lambda s: dict(e=when(s.x != 0.5, mode=1.0)), "tests real numbers for equality"),
    "equal in a joined array": (
        lambda s: dict(e=when(jnp.any(jnp.stack([s.x == 0.5, s.x > 2.0])), mode=1.0)),
        "tests real numbers for equality",
    ),
    "equal in logic": (lambda s: dict(e=when((s.mode > 0) | ~(2 * s.x == 1.0), mode=1.0)), "tests real numbers"),
    "equal in an array": (lambda s: dict(e=when(jnp.any(s.x == jnp.arange(3.0)), mode=1.0)), "tests real numbers"),
}


@pytest.mark.parametrize("name", BAD_EVENTS)
def test_events_that_are_refused(name: str) -> None:
    stated, message = BAD_EVENTS[name]
    with pytest.raises(ModelError, match="(?s)" + message):
        simulate(Holder(part=Rising(stated=stated)), 1.0)


@pytest.mark.thorough
def test_times_may_be_a_list_with_variables() -> None:
    model = Rising(stated=lambda s: dict(e=at(TIMES(s), mode=s.mode + 0.125)))
    assert simulate(model, 0.7, save="end").final.mode == 0.25


@pytest.mark.thorough
@pytest.mark.parametrize(
    "condition",
    [
        lambda s: s.mode == 1.0,
        lambda s: jnp.floor(3 * s.x) == 1.0,
        lambda s: jnp.where(s.x > 0.5, 1.0, 0.0) == 1.0,
        lambda s: jnp.where(s.x == 0.0, 1.0, jnp.sin(s.x) / jnp.where(s.x == 0.0, 1.0, s.x)) < 0.95,
    ],
)
def test_what_takes_few_values_may_be_compared(condition: Callable[[Any], Any]) -> None:
    model = Rising(stated=lambda s: dict(start=at(0.25, mode=1.0), e=when(condition(s), mode=2.0)))
    assert simulate(model, 1.0, save="end").final.mode == 2.0


@jax.custom_vjp
def square(x: Scalar) -> Scalar:
    return x * x


square.defvjp(lambda x: (x * x, x), lambda x, change: (2.0 * x * change,))


def power(x: Scalar, n: Scalar) -> Scalar:
    """x^n by as many products."""
    return jax.lax.while_loop(lambda s: s[0] < n, lambda s: (s[0] + 1.0, s[1] * x), (0.0 * n, 1.0 + 0.0 * x))[1]


class Square(Component):
    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -square(self.x), check_units=False))


class Loop(Component):
    n: Param[Scalar, ""] = 3.0
    x: Var[Scalar, ""] = 1.0
    y: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -self.y, check_units=False), law=eq(power(self.y, self.n) + self.y, self.x))


class Branch(Component):
    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -self.x if self.x > 0.0 else 0.0, check_units=False))


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (Square, r"Square\.equations calls a function with its own derivative in reverse mode .* jax\.custom_jvp"),
        (Loop, r"part\.law contains a loop of variable length .* a loop of fixed length"),
        (Branch, r"Branch\.equations needs the truth value of a relation .* jnp\.where instead of `if`"),
    ],
)
def test_equations_that_are_refused(part: Callable[[], Component], message: str) -> None:
    with pytest.raises(ModelError, match="(?s)" + message):
        simulate(Holder(part=part()), 1.0)


def test_parts_in_a_dictionary_are_refused() -> None:
    class Parts(Component):
        parts: dict[str, Component]

    with pytest.raises(ModelError, match=r"Parts\.parts\['a'\] holds Branch, .* several with tuple"):
        Parts(parts={"a": Branch()})

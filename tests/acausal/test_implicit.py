"""Roots of starts, nearest points, nonlinear blocks and poles: derivatives of any order, in both modes."""

from collections.abc import Callable, Iterable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _mechanisms import Pendulum
from _models import Diode

from acausal import (
    Array,
    Component,
    Connections,
    Equations,
    Param,
    Scalar,
    Var,
    connect,
    eq,
    initialise,
    linearise,
    repeat,
    replace,
    simulate,
)
from acausal._evaluate.building import system_of
from acausal._evaluate.implicit import nearest, refined
from acausal._evaluate.initial import initial_state
from acausal._evaluate.invariants import onto_invariants
from acausal._evaluate.observe import observe
from components.electrical import Capacitor, ConstantVoltage, Ground, Resistor

Function = Callable[..., Any]


Mode = Callable[[Function], Function]
BOTH: tuple[Mode, ...] = (jax.jacfwd, jax.jacrev)


def check_second(
    f: Function, at: Any, exact: Function | None = None, rtol: float = 1e-6, modes: Iterable[Mode] = BOTH
) -> None:
    """The second derivatives of f(p), p a vector, against differences of first ones and those of a closed form."""
    p = jnp.asarray(at)
    first, steps = jax.jit(jax.jacfwd(f)), 1e-4 * jnp.diag(jnp.abs(p))
    moved = [(first(p + step) - first(p - step)) / (2.0 * jnp.max(step)) for step in steps]
    difference = np.stack(moved, axis=-1)
    size = np.max(np.abs(difference))
    closed = None if exact is None else jax.jit(jax.hessian(exact))(p)
    for mode in modes:
        found = jax.jit(mode(mode(f)))(p)
        np.testing.assert_allclose(found, difference, rtol=rtol, atol=rtol * size)
        if closed is not None:
            np.testing.assert_allclose(found, closed, rtol=1e-8, atol=1e-8 * size)


def root_of(g: Function, start: float, *numbers: Any) -> Any:
    """The root of a scalar function by real steps of Newton's method, which derivatives follow."""
    return jax.lax.fori_loop(0, 60, lambda _, x: x - g(x, *numbers) / jax.grad(g)(x, *numbers), jnp.asarray(start))


class Clipping(Component, partial=True):
    """A source with a resistance, and a diode across its terminals."""

    source: ConstantVoltage
    r: Resistor
    diode: Diode
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.r.p),
            connect(self.r.n, self.diode.p),
            connect(self.source.n, self.diode.n, self.ground.p),
        )


class Clipper(Clipping):
    def connections(self) -> Connections:
        return super().connections()


class Smoothed(Clipping):
    """With a capacitor across the diode, whose voltage is a state."""

    c: Capacitor

    def connections(self) -> Connections:
        return (*super().connections(), connect(self.diode.p, self.c.p), connect(self.diode.n, self.c.n))


def smoothed(p: Any) -> Smoothed:
    return Smoothed(**parts(p), c=Capacitor(C=1e-6))


NODE = (100.0, 5.0)  # ohm, V


def parts(p: Any) -> dict[str, Any]:
    return dict(source=ConstantVoltage(V=p[1]), r=Resistor(R=p[0]), diode=Diode(saturation=1e-12, v=0.62))


def node(p: Any) -> Any:
    """The voltage at which the currents of resistor and diode are one."""
    return root_of(lambda v: (p[1] - v) / p[0] - 1e-12 * jnp.expm1(v / 0.025), 0.62)


@pytest.mark.thorough
def test_state_at_rest() -> None:
    check_second(lambda p: initialise(smoothed(p), steady=True).c.v, NODE, node)


def test_higher_derivatives_of_a_nearest_point() -> None:
    """On the circle of radius r, from a point outside: to the fourth order, along a line through all numbers."""

    def on_circle(x: Any, args: Any) -> Any:
        return (jnp.sum(x**2) - args**2)[None]

    def point(t: Any) -> Any:
        start, radius = jnp.stack([1.0 + t, 2.0 - t**2]), 1.5 + jnp.sin(t)
        found = refined(on_circle, jnp.linalg.pinv, radius * jnp.array([0.6, 0.8]), start, radius)
        return nearest(on_circle, jnp.linalg.pinv, found, start, radius)

    def closed(t: Any) -> Any:
        start, radius = jnp.stack([1.0 + t, 2.0 - t**2]), 1.5 + jnp.sin(t)
        return radius * start / jnp.linalg.norm(start)

    for modes in ("ffff", "frrr", "rfrf"):
        f, g = point, closed
        for mode in modes:
            f, g = ((jax.jacfwd if mode == "f" else jax.jacrev)(h) for h in (f, g))
            np.testing.assert_allclose(jax.jit(f)(0.3), jax.jit(g)(0.3), rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_run_that_starts_at_rest() -> None:
    def later(p: Any) -> Any:
        rest = initialise(smoothed(p), steady=True)
        return simulate(rest, 1e-5, save="end", rtol=1e-9).final.c.v

    check_second(later, NODE, node, modes=BOTH[:1])


def seen(model: Component, name: str) -> Any:
    """A variable of a model without states."""
    system = system_of(model)
    leaf = next(i for i, leaf in enumerate(system.flat.leaves) if leaf.path == name)
    return observe(system, 0.0, jnp.zeros(0), system.pack(model), [leaf])[0]


@pytest.mark.thorough
def test_unknown_of_a_nonlinear_block() -> None:
    check_second(lambda p: seen(Clipper(**parts(p)), "diode.v"), NODE, node)


class Row(Component):
    """Alike clippers side by side, whose blocks are solved together."""

    members: Array[Clipper]

    def connections(self) -> Connections:
        return ()


@pytest.mark.thorough
def test_unknowns_of_many_blocks() -> None:
    resistances = jnp.array([1.0, 2.0, 5.0])

    def row(p: Any) -> Any:
        model = Row(members=repeat(Clipper(**parts(p)), 3))
        model = replace(model, {"members.item.r.R": p[0] * resistances})
        return seen(model, "members[].diode.v")

    check_second(row, NODE, lambda p: jnp.stack([node(jnp.stack([k * p[0], p[1]])) for k in resistances]))


@pytest.mark.thorough
def test_nearest_point() -> None:
    """The bob is brought onto its circle along the radius."""

    def bob(p: Any) -> Any:
        model = initialise(Pendulum(L=p[0], x=p[1], y=p[2]), free="all")
        return jnp.stack([model.x, model.y])

    check_second(bob, (1.2, 0.7, -1.9), lambda p: p[0] * p[1:] / jnp.linalg.norm(p[1:]))


def test_nearest_point_of_several_states() -> None:
    """One condition leaves a point open: that of least distance in nominal sizes is found."""

    def start(p: Any) -> Any:
        model = initialise(TwoStores(x=p[1], y=p[2]), lambda s, d: dict(sum=eq(s.x**2 * s.y, p[0])), free="all")
        return jnp.stack([model.x, model.y])

    def closed(p: Any) -> Any:
        """On y = p0 / x^2, the distance to (p1, p2) has no slope."""
        slope = jax.grad(lambda x: (x - p[1]) ** 2 + (p[0] / x**2 - p[2]) ** 2)
        x = root_of(slope, 1.2)
        return jnp.stack([x, p[0] / x**2])

    check_second(start, (2.0, 1.0, 1.5), closed)


class TwoStores(Component):
    """Two states that nothing relates."""

    x: Var[Scalar, "1"] = 1.0
    y: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(first=eq(d.x, -self.x, check_units=False), second=eq(d.y, -self.y, check_units=False))


@pytest.mark.thorough
def test_conditions_that_repeat_each_other() -> None:
    def start(p: Any) -> Any:
        model = initialise(
            TwoStores(),
            lambda s, d: dict(
                product=eq(s.x * s.y, p[0]), twice=eq(2.0 * s.x * s.y, 2.0 * p[0]), ratio=eq(s.y, p[1] * s.x)
            ),
        )
        return jnp.stack([model.x, model.y])

    check_second(start, (2.0, 1.5), lambda p: jnp.stack([jnp.sqrt(p[0] / p[1]), jnp.sqrt(p[0] * p[1])]))


@pytest.mark.thorough
def test_start_value_of_an_algebraic_variable() -> None:

    def start(p: Any) -> Any:
        model = Squared(z=p[0], k=p[1])
        return initial_state(system_of(model), 0.0, system_of(model).pack(model))[0][0]

    check_second(start, (2.0, 1.5), lambda p: jnp.sqrt(p[0] / p[1]))


class Squared(Component):
    """A state x, and z = k x^2."""

    k: Param[Scalar, "1"]
    x: Var[Scalar, "1"] = 1.0
    z: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x, check_units=False), square=eq(self.z, self.k * self.x**2))


@pytest.mark.thorough
def test_return_to_invariants() -> None:
    """A pendulum all of whose coordinates are states; with no speed they yield alike."""

    def bob(p: Any) -> Any:
        system = system_of(Pendulum())
        order = [system.state_names.index(name) for name in ("x", "y", "u", "v")]
        y = jnp.zeros(4).at[np.array(order)].set(jnp.array([p[1], p[2], 0.0, 0.0]))
        return onto_invariants(system, 0.0, y, system.pack(Pendulum(L=p[0])))[np.array(order[:2])]

    check_second(bob, (1.0, 0.6, -0.80001), lambda p: p[0] * p[1:] / jnp.linalg.norm(p[1:]), rtol=1e-4)


@pytest.mark.thorough
def test_poles() -> None:
    """The poles are the roots of m s^2 + d s + c, and are differentiated by its coefficients."""

    def rates(p: Any) -> Any:
        pole = linearise(Oscillator(c=p[0], d=p[1])).poles[0]
        return jnp.stack([pole.real, pole.imag])

    check_second(rates, (40.0, 3.0), lambda p: jnp.stack([-0.5 * p[1], jnp.sqrt(p[0] - 0.25 * p[1] ** 2)]))


class Oscillator(Component):
    c: Param[Scalar, "1"]
    d: Param[Scalar, "1"]
    x: Var[Scalar, "1"] = 1.0
    v: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(
            speed=eq(d.x, self.v, check_units=False),
            force=eq(d.v, -self.c * self.x - self.d * self.v, check_units=False),
        )


@pytest.mark.thorough
def test_pole_of_a_steady_state() -> None:
    """The conductance of the diode at rest, and with it the pole of node and capacitor."""

    def pole(p: Any) -> Any:
        return linearise(initialise(smoothed(p), steady=True)).poles[0].real

    check_second(pole, NODE, lambda p: -1e6 * (1.0 / p[0] + 1e-12 / 0.025 * jnp.exp(node(p) / 0.025)))

"""Initial equations that components state, wherever a start is needed."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Array,
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    ModelError,
    Param,
    Scalar,
    SimulationError,
    Time,
    UnitError,
    Var,
    Vector,
    at,
    check,
    connect,
    eq,
    initialise,
    linearise,
    positive,
    prefer,
    repeat,
    replace,
    shape,
    simulate,
    when,
)
from acausal._evaluate.building import mass_matrix_form, system_of
from components.blocks import SISO, Constant, Gain, Integrator, TwoPointController
from components.rotational import IdealGear, Inertia, SignalTorque, SpeedSensor


class Lag(SISO):
    """T dx/dt = k u - x, from rest."""

    T: Param[Scalar, "s", positive] = 0.5
    k: Param[Scalar, ""] = 2.0
    x: Var[Scalar, "", prefer] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(self.T * d.x, self.k * self.u.value - self.x), output=eq(self.y.value, self.x))

    def initial_equations(self, d: Self) -> Equations:
        return dict(rest=eq(d.x))


class Driven(Component):
    """A rotor with friction that a lag of its own speed drives."""

    sensor: SpeedSensor
    lag: Lag
    gain: Gain
    drive: SignalTorque
    rotor: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.rotor.a, self.sensor.flange, self.drive.flange),
            connect(self.sensor.y, self.lag.u),
            connect(self.lag.y, self.gain.u),
            connect(self.gain.y, self.drive.u),
        )


def driven(k: Any = 2.0, gain: Any = -0.5, **start: Any) -> Driven:
    return Driven(
        sensor=SpeedSensor(), lag=Lag(k=k), gain=Gain(k=gain), drive=SignalTorque(), rotor=Inertia(J=0.1, **start)
    )


@pytest.mark.thorough
def test_a_component_starts_from_rest() -> None:
    """Its own state follows; the speed that it measures keeps what its class says, or the model."""
    for w, start in ((3.0, {"w": 3.0}), (0.0, {})):
        solution = simulate(driven(**start), 0.1)
        assert float(solution["lag.x"][0]) == pytest.approx(2.0 * w, rel=1e-12, abs=1e-14)
        assert float(solution["rotor.w"][0]) == pytest.approx(w, rel=1e-12, abs=1e-14)


@pytest.mark.thorough
def test_wherever_a_start_is_needed() -> None:
    """`initialise` without conditions finds the start of a run, and `linearise` linearises there; a view stays."""
    model = driven(w=3.0)
    found: Any = initialise(model)
    np.testing.assert_allclose([found.lag.x, found.rotor.w], [6.0, 3.0], rtol=1e-12)
    rates = linearise(model).rates
    # dx/dt = 0, J dw/dt = gain x
    np.testing.assert_allclose(sorted(np.asarray(rates)), sorted([0.0, -0.5 * 6.0 / 0.1, 3.0]), rtol=1e-12, atol=1e-12)
    later = simulate(model, 0.1, save="end").final
    elsewhere = linearise(model, at=later)
    rate = (2.0 * float(later.rotor.w) - float(later.lag.x)) / 0.5
    assert float(elsewhere.rates[elsewhere.states.index("lag.x")]) == pytest.approx(rate, rel=1e-12)
    with pytest.raises(ModelError, match=r"gives no value for sensor\.flange\.phi: it must be a view"):
        linearise(model, at=found)
    fixed = simulate(model, 0.1, system=mass_matrix_form(system_of(model)), save="end").final
    assert float(fixed.lag.x) == pytest.approx(float(simulate(model, 0.1, save="end").final.lag.x), rel=1e-6)
    assert check(model)


@pytest.mark.thorough
def test_other_states_move_only_where_they_must() -> None:
    """If the start value of the lag is given, the speed follows. If both are given, there is no start."""
    assert float(simulate(driven_with(4.0), 0.1)["rotor.w"][0]) == pytest.approx(2.0, rel=1e-12)
    both = replace(driven_with(4.0), {"rotor.w": 3.0})
    said = (
        r"(?s)No start values satisfy the conditions\. Not met: lag\.rest\..*in conflict.*: lag\.rest\..*"
        r"Remedy: remove one of the conditions, or omit or free a start value: lag\.x, rotor\.w, or"
    )
    for refused in (lambda: simulate(both, 0.1), lambda: initialise(both), lambda: linearise(both)):
        with pytest.raises(SimulationError, match=said):
            refused()
    assert "lag.rest" in str(check(both))
    assert "start values contradict" in str(simulate(both, 0.1, throw=False).result)


def driven_with(x: float) -> Driven:
    return replace(driven(), {"lag.x": x})


@pytest.mark.thorough
def test_conditions_come_on_top() -> None:
    """With conditions of `initialise`, the speed is 5 rad/s, so x = 10. At rest, where 0 = gain x, both are zero."""
    found: Any = initialise(driven(), lambda s, d: dict(speed=eq(s.rotor.w, 5.0)))
    np.testing.assert_allclose([found.lag.x, found.rotor.w], [10.0, 5.0], rtol=1e-12)
    rest: Any = initialise(driven(w=3.0), steady=True, moving=["rotor.a.phi"])
    np.testing.assert_allclose([rest.lag.x, rest.rotor.w], [0.0, 0.0], atol=1e-12)


class Mixed(Component):
    """Two states and an algebraic variable, of which z = p and dy/dt = 0 at the start: x = y = sqrt(p)."""

    p: Param[Scalar, "1"]
    T: Param[Scalar, "s"] = 1.0
    x: Var[Scalar, "1", prefer] = 1.0
    y: Var[Scalar, "1", prefer] = 0.0
    z: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            first=eq(self.T * d.x, self.z - self.x),
            second=eq(self.T * d.y, self.x - self.y),
            square=eq(self.z, self.x**2),
        )

    def initial_equations(self, d: Self) -> Equations:
        return dict(value=eq(self.z, self.p), rest=eq(d.y))


class Many(Component):
    cells: Array[Mixed]
    one: Mixed


@pytest.mark.thorough
def test_arrays_of_components() -> None:
    p = jnp.array([0.5, 1.0, 2.0])
    start = initialise(Many(cells=repeat(Mixed(p=p), 3), one=Mixed(p=1.5)))
    np.testing.assert_allclose(start.cells.item.x, np.sqrt(p), rtol=1e-11)
    np.testing.assert_allclose(start.cells.item.y, np.sqrt(p), rtol=1e-11)
    np.testing.assert_allclose(start.one.x, np.sqrt(1.5), rtol=1e-11)
    model = Many(cells=repeat(replace(Mixed(p=p), {"x": jnp.sqrt(p) + np.array([0.0, 1.0, 0.0])}), 3), one=Mixed(p=1.5))
    with pytest.raises(SimulationError, match=r"Not met: cells\[1\]\.value\."):
        simulate(model, 0.1)


@pytest.mark.thorough
def test_derivatives_of_a_start() -> None:
    """dy/dp = 1 / (2 sqrt(p)) in both modes and under `jit` and `vmap`; the second one; and that of a run, in which
    y(t) = sqrt(p) e^-t + ... is compared with differences.
    """

    def start(p: Any) -> Any:
        return initialise(Mixed(p=p)).y

    def end(p: Any) -> Any:
        return simulate(Mixed(p=p), 0.5, save="end", rtol=1e-9).final.y

    def both(function: Any) -> Any:
        return jax.jit(jax.vmap(lambda p: (function(p), jax.jacfwd(function)(p), jax.grad(function)(p))))

    p = jnp.array([0.7, 1.3])
    for found in both(start)(p)[1:]:
        np.testing.assert_allclose(found, 0.5 * p**-0.5, rtol=1e-9)
    second = jax.jit(jax.jacfwd(jax.grad(start)))(p[0])
    np.testing.assert_allclose(second, -0.25 * p[0] ** -1.5, rtol=1e-8)
    values, *slopes = both(end)(jnp.array([0.7 - 1e-4, 0.7, 0.7 + 1e-4]))
    for found in slopes:
        assert float(found[1]) == pytest.approx((float(values[2]) - float(values[0])) / 2e-4, rel=1e-6)


class Linear(Component):
    """dx/dt = A x + b, with C x + D dx/dt = r at the start."""

    n: int
    m: int
    A: Param[Vector, "1", shape("n", "n")]
    b: Param[Vector, "1", shape("n")]
    C: Param[Vector, "1", shape("m", "n")]
    D: Param[Vector, "1", shape("m", "n")]
    r: Param[Vector, "1", shape("m")]
    T: Param[Scalar, "s"] = 1.0
    x: Var[Vector, "1", shape("n")] = 0.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        return dict(motion=eq(self.T * d.x, self.A @ self.x + self.b))

    def initial_equations(self, d: Self) -> Equations:
        return dict(law=eq(self.C @ self.x + self.D @ (self.T * d.x), self.r))


@pytest.mark.thorough
def test_random_linear_conditions() -> None:
    """The nearest point to the start values of the class, (C + D A) x = r - D b; conditions that repeat each other as
    long as they agree, too.
    """
    n, m = 4, 3
    rng = np.random.default_rng(0)
    A, b, D = (rng.normal(size=(20, *s)) for s in ((n, n), (n,), (m, n)))
    C = rng.normal(size=(20, m, n))
    C[10:, 2], D[10:, 2] = C[10:, 0] - C[10:, 1], D[10:, 0] - D[10:, 1]
    r = rng.normal(size=(20, m))
    r[10:, 2] = r[10:, 0] - r[10:, 1]

    def begin(A: Any, b: Any, C: Any, D: Any, r: Any) -> Any:
        return initialise(Linear(n=n, m=m, A=A, b=b, C=C, D=D, r=r)).x

    M = C + D @ A
    exact = np.linalg.pinv(M, rtol=1e-9) @ (r - np.einsum("kij,kj->ki", D, b))[..., None]
    found = jax.jit(jax.vmap(begin))(A, b, C, D, r)
    np.testing.assert_allclose(found, exact[..., 0], rtol=1e-8, atol=1e-9)
    by_r = jax.jit(jax.vmap(jax.jacrev(begin, argnums=4)))(A[:10], b[:10], C[:10], D[:10], r[:10])
    np.testing.assert_allclose(by_r, np.linalg.pinv(M[:10]), rtol=1e-7, atol=1e-8)


class Charged(Component):
    """A store that holds what a switch lets in, at rest at the start; what happened by then is counted."""

    T: Param[Scalar, "s"] = 1.0
    t: Time[Scalar, "s"] = 0.0
    x: Var[Scalar, "1"] = 0.0
    y: Var[Scalar, "s"] = 0.0
    q: Discrete[Scalar, "1"] = 1.0
    n: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(store=eq(self.T * d.x, self.q + self.n - self.x), late=eq(self.T * d.y, self.t - self.y))

    def initial_equations(self, d: Self) -> Equations:
        return dict(rest=eq(d.x), still=eq(d.y))

    def events(self) -> Events:
        return dict(full=when(self.x > 0.5, q=3.0), count=at(1.0, n=self.n + 1.0))


@pytest.mark.thorough
def test_modes_and_past_events() -> None:
    """With q = 1 it would rest at 1, where q becomes 3. What was due before the start happens once."""
    early, late = (simulate(Charged(), 0.1 + t0, t0=t0) for t0 in (0.0, 2.0))
    np.testing.assert_allclose([early["x"][0], early["q"][0], early["n"][0], early["y"][0]], [3.0, 3.0, 0.0, 0.0])
    np.testing.assert_allclose([late["x"][0], late["q"][0], late["n"][0], late["y"][0]], [4.0, 3.0, 1.0, 2.0])
    np.testing.assert_allclose(late["x"], 4.0, rtol=1e-12)
    np.testing.assert_allclose(linearise(Charged(), t=2.0).rates, [0.0, 0.0], atol=1e-12)


class Filled(Component):
    """A vessel that starts at a set point, with a pump that runs from when it falls below a band until it is above."""

    level: Param[Scalar, ""] = 4.0
    wanted: Constant
    pump: TwoPointController
    vessel: Integrator

    def connections(self) -> Connections:
        return (
            connect(self.wanted.y, self.pump.u_s),
            connect(self.pump.y, self.vessel.u),
            connect(self.vessel.y, self.pump.u_m),
        )

    def initial_equations(self, d: Self) -> Equations:
        return dict(filled=eq(self.vessel.y.value, self.level))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("level", "is_on", "then"), [(4.0, 0.0, 0.0), (4.0, 1.0, 1.0), (3.0, 0.0, 1.0), (5.0, 1.0, 0.0)]
)
def test_a_guess_switches_nothing(level: float, is_on: float, then: float) -> None:
    """Within the band a controller stays as it was. The search begins at an empty vessel, far below the band."""
    model = Filled(
        level=level, wanted=Constant(k=4.0), pump=TwoPointController(bandwidth=1.0, is_on=is_on), vessel=Integrator()
    )
    assert float(initialise(model).pump.is_on) == then
    run = simulate(model, 0.1)
    np.testing.assert_allclose([run["pump.is_on"][0], run["vessel.y.value"][0]], [then, level], rtol=1e-12)


class Geared(Component):
    """Two wheels on a gear, of which the second one turns at w0 at the start."""

    w0: Param[Scalar, "rad/s"]
    one: Inertia
    gear: IdealGear
    other: Inertia

    def connections(self) -> Connections:
        return connect(self.one.b, self.gear.a), connect(self.gear.b, self.other.a)

    def initial_equations(self, d: Self) -> Equations:
        return dict(turns=eq(self.other.w, self.w0), place=eq(self.other.a.phi, 0.25))


@pytest.mark.thorough
def test_composites_and_what_is_tied() -> None:
    model = Geared(w0=2.0, one=Inertia(J=1.0), gear=IdealGear(ratio=3.0), other=Inertia(J=1.0))
    run = simulate(model, 0.1)
    np.testing.assert_allclose([run["one.w"][0], run["one.a.phi"][0]], [6.0, 0.75], rtol=1e-12)
    with pytest.raises(SimulationError, match=r"(?s)Not met: .*turns\.\n.*in conflict.*: .*turns"):
        simulate(replace(model, {"one.w": 5.0}), 0.1)


def test_what_cannot_be_stated() -> None:
    class Listed(Component):
        T: Param[Scalar, "s"] = 1.0
        x: Var[Scalar, "m"] = 0.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(self.T * d.x, -self.x))

        def initial_equations(self, d: Self) -> Equations:
            return [eq(self.x)]  # pyright: ignore[reportReturnType]

    class Rate(Component):
        T: Param[Scalar, "s"] = 1.0
        x: Var[Scalar, "m"] = 0.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(self.T * d.x, -self.x))

        def initial_equations(self, d: Self) -> Equations:
            return dict(rest=eq(self.x, d.T))

    class Units(Component):
        x: Param[Scalar, "s"] = 1.0
        y: Var[Scalar, "m"] = 0.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(self.x * d.y, -self.y))

        def initial_equations(self, d: Self) -> Equations:
            return dict(rest=eq(d.y, self.y))

    for model, error, said in (
        (Listed(), ModelError, r"Listed\.initial_equations must return a dictionary of named equations"),
        (Rate(), ModelError, r"Rate\.initial_equations uses d\.T, but T is a parameter"),
        (Units(), UnitError, r"Units, initial equation rest: equates d\.y in m/s with self\.y in m"),
    ):
        with pytest.raises(error, match=said):
            simulate(model, 0.1)
        assert not check(model)


@pytest.mark.thorough
def test_a_condition_on_nothing_that_can_move() -> None:
    class Claim(Component):
        p: Param[Scalar, "s"]
        x: Var[Scalar, "1"] = 0.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(self.p * d.x, -self.x))

        def initial_equations(self, d: Self) -> Equations:
            return dict(known=eq(self.p, 2.0, check_units=False))

    assert float(simulate(Claim(p=2.0), 0.1).t1) == 0.1
    with pytest.raises(SimulationError, match=r"dependent: known\.\n  Remedy: remove one of the conditions, or, if"):
        simulate(Claim(p=3.0), 0.1)


@pytest.mark.thorough
def test_under_jit_a_start_that_does_not_exist_is_a_result() -> None:
    def run(x: Any) -> Any:
        return simulate(replace(driven(w=3.0), {"lag.x": x}), 0.1, throw=False, save="end").result

    from acausal import Result

    results = jax.jit(jax.vmap(run))(jnp.array([6.0, 4.0]))
    np.testing.assert_array_equal(results == Result.bad_start, [False, True])

"""`linearise`: matrices, operating points, names, and the responses that follow."""

import sys
from collections.abc import Callable
from typing import Any, Self

import control
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _linear_models import C, Divider, J, K, L, R, motor_rig, rlc, two_mass
from _mechanisms import Pendulum, driven_capacitor
from _models import gear_train, oscillator, rc, rectifier
from _switching_models import Undoing

from acausal import (
    Component,
    Equations,
    LinearSystem,
    ModelError,
    Param,
    ParameterError,
    Scalar,
    SimulationError,
    Var,
    Vector,
    avoid,
    choose_states,
    eq,
    linearise,
    prefer,
    replace,
    shape,
    simulate,
)
from components.electrical import ConstantVoltage, Resistor


@pytest.fixture(scope="module")
def motor() -> LinearSystem:
    return linearise(motor_rig(), inputs=["supply.V", "load.torque"], outputs=["motor.rotor.w", "motor.p.i"])


def _motor_response(s: complex) -> np.ndarray:
    """Speed and current (down) for voltage and torque (across)."""
    winding, rotor = L * s + R, J * s + C
    return np.array([[K, winding], [rotor, -K]]) / (winding * rotor + K**2)


def test_motor_matrices(motor: LinearSystem) -> None:
    order = [motor.states.index(name) for name in ("motor.inductor.i", "motor.rotor.w")]
    np.testing.assert_allclose(np.array(motor.A)[np.ix_(order, order)], [[-R / L, -K / L], [K / J, -C / J]], rtol=1e-14)
    np.testing.assert_allclose(np.array(motor.B)[order], [[1 / L, 0], [0, 1 / J]], rtol=1e-14)
    np.testing.assert_array_equal(np.array(motor.D), np.zeros((2, 2)))
    assert [motor.unit(name) for name in ("motor.rotor.w", "supply.V", "load.torque")] == ["rad/s", "V", "N.m"]


def test_motor_frequency_response(motor: LinearSystem) -> None:
    ws = np.array([0.01, 3.0, 50.0, 4000.0])
    expected = np.array([_motor_response(1j * w) for w in ws])
    np.testing.assert_allclose(np.array(motor.frequency_response(ws)), expected, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(motor.dc_gain, np.real(_motor_response(0.0)), rtol=1e-12)


def test_motor_transfer_functions(motor: LinearSystem) -> None:
    denominator = np.array([L * J, R * J + L * C, R * C + K**2])
    speed = motor.transfer_function("motor.rotor.w", "supply.V")
    np.testing.assert_allclose(speed.denominator, denominator / denominator[0], rtol=1e-12)
    np.testing.assert_allclose(speed.numerator, [K / (L * J)], rtol=1e-12)
    current = motor.transfer_function("motor.p.i", "supply.V")
    np.testing.assert_allclose(current.numerator, np.array([J, C]) / (L * J), rtol=1e-12)
    np.testing.assert_allclose(motor.channel("motor.p.i", "supply.V").zeros, [-C / J], rtol=1e-12)
    assert len(motor.zeros) == 0


@pytest.mark.thorough
def test_motor_responses(motor: LinearSystem) -> None:
    """A partial-fraction expansion of the transfer function over the poles."""
    ts = np.linspace(0.0, 0.2, 21)
    p, q = np.roots([L * J, R * J + L * C, R * C + K**2])
    gain = K / (L * J)
    impulse = gain * (np.exp(p * ts) - np.exp(q * ts)) / (p - q)
    step = gain * (np.expm1(p * ts) / p - np.expm1(q * ts) / q) / (p - q)
    channel = motor.channel("motor.rotor.w", "supply.V")
    np.testing.assert_allclose(np.array(channel.impulse_response(ts))[:, 0, 0], impulse.real, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(np.array(channel.step_response(ts))[:, 0, 0], step.real, rtol=1e-10, atol=1e-11)


@pytest.mark.thorough
def test_response_is_that_of_a_simulation() -> None:
    """The motor is linear, so the difference of two runs is the response to the difference of the voltages."""
    ts = jnp.linspace(0.0, 0.05, 11)
    low, high = (
        simulate(eqx.tree_at(lambda m: m.supply.V, motor_rig(), V), 0.05, save=ts, rtol=1e-9) for V in (3.0, 5.0)
    )
    system = linearise(motor_rig(), inputs=["supply.V"], outputs=["motor.rotor.w"])
    difference = np.array(high["motor.rotor.w"] - low["motor.rotor.w"])
    np.testing.assert_allclose(2.0 * system.step_response(ts)[:, 0, 0], difference, rtol=1e-6, atol=1e-7)


@pytest.mark.thorough
def test_python_control() -> None:
    system = linearise(rlc(), inputs=["source.V"], outputs=["c.v", "r.i"])
    exported = system.to_control()
    assert exported.input_labels == ["source_V"]
    assert exported.output_labels == ["c_v", "r_i"]
    assert exported.state_labels == [name.replace(".", "_") for name in system.states]
    ts = np.linspace(0.0, 1e-3, 101)
    response = control.step_response(exported, ts).outputs[:, 0].T
    np.testing.assert_allclose(np.array(system.step_response(ts))[:, :, 0], response, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(system.dc_gain, exported.dcgain(), atol=1e-12)


def test_without_python_control(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ModelError, match=r"acausal\[control\]"):
        linearise(rlc()).to_control()


@pytest.mark.slow
def test_against_finite_differences() -> None:
    """A nonlinear circuit, away from its equilibrium."""
    model = rectifier(1.0)
    sol = simulate(model, 0.02, rtol=1e-9)
    found = linearise(model, at=sol.final, inputs=["source.V", "diode.saturation"], outputs=[lambda s: s.r.v * s.r.i])
    system, y, h = sol.system, sol.ys[-1], 1e-5

    def rates(y: Any, V: Any = 1.0) -> Any:
        changed = eqx.tree_at(lambda m: m.source.V, model, V)
        return system.vector_field(0.02, y, system.pack(changed))

    np.testing.assert_allclose(found.A, (rates(y + h) - rates(y - h))[:, None] / (2 * h), rtol=1e-7)
    np.testing.assert_allclose(found.B[:, 0], (rates(y, 1.0 + h) - rates(y, 1.0 - h)) / (2 * h), rtol=1e-7)
    np.testing.assert_allclose(found.rates, rates(y), rtol=1e-12)
    # P = R i^2 with i = C dv/dt: a chain rule for C and D.
    slope = 2.0 * 100.0 * float(sol.final.r.i) * 1e-3
    np.testing.assert_allclose(found.C, slope * np.array(found.A), rtol=1e-10)
    np.testing.assert_allclose(found.D, slope * np.array(found.B), rtol=1e-10)


@pytest.mark.slow
def test_operating_points_agree() -> None:
    """A view, the state vector behind it, and start values."""
    model = rectifier(1.0)
    sol = simulate(model, 0.2, save="dense", rtol=1e-9)
    of_view = linearise(model, at=sol.at(0.2))
    np.testing.assert_allclose(of_view.A, linearise(model, at=sol.final).A, rtol=1e-9)
    np.testing.assert_array_equal(linearise(model, at=sol.final).A, linearise(model, at=sol.ys[-1]).A)
    started = replace(model, {"c.v": float(sol.final.c.v)})
    np.testing.assert_allclose(linearise(started).A, of_view.A, rtol=1e-9)
    assert abs(float(linearise(model).A[0, 0] / of_view.A[0, 0])) > 1.2


@pytest.mark.thorough
def test_other_choice_of_states() -> None:
    """A view serves any choice of states, and the poles do not depend on it."""
    model = gear_train(3.0, torque=1.0, w1=0.5)
    sol = simulate(model, 1.0)
    system = choose_states(model, algebraic="integrate")
    a = linearise(model, at=sol.final, inputs=["drive.torque"], outputs=["second.w"])
    b = linearise(model, at=sol.final, inputs=["drive.torque"], outputs=["second.w"], system=system)
    gain = 1.0 / (3.0 * (1.5 + 4.0 / 9.0))
    for linear in (a, b):
        np.testing.assert_allclose(linear.impulse_response(np.array([0.0, 2.0]))[:, 0, 0], gain, rtol=1e-12)
        assert np.isinf(linear.dc_gain[0, 0])


class Slider(Component):
    """A mass on a spring with a cubic damper, driven by an angle phi = s / r; no speed is preferred as a state."""

    c: Param[Scalar, "N/m"] = 50.0
    r: Param[Scalar, "m"] = 0.2
    m: Param[Scalar, "kg"] = 2.0
    J: Param[Scalar, "kg.m2"] = 0.02
    d3: Param[Scalar, "N.s3/m3"] = 4.0
    phi: Var[Scalar, "rad", prefer] = 3.0
    s: Var[Scalar, "m", avoid] = 0.0
    v: Var[Scalar, "m/s", avoid] = 0.0
    w: Var[Scalar, "rad/s", avoid] = 0.0  # of a wheel on the same shaft

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.s, self.r * self.phi),
            speed=eq(self.v, d.s),
            wheel=eq(self.w, 3.0 * d.phi),
            newton=eq(self.m * d.v + self.J / self.r * d.w, -self.c * self.s - self.d3 * self.v**3),
        )


@pytest.mark.thorough
def test_state_that_no_variable_holds() -> None:
    """der(phi) is a state, but not in a view: it follows from the speed v = 0.2 der(phi)."""
    sol = simulate(Slider(), 0.1, rtol=1e-9)
    linear = linearise(Slider(), at=sol.final)
    assert "der(phi)" in linear.states
    assert linear.unit("der(phi)") == "rad/s"
    np.testing.assert_allclose(linear.A, linearise(Slider(), at=sol.ys[-1]).A, rtol=1e-9)


class Rod(Component):
    """Three nodes of a rod that conducts heat, dT/dt = -k (T - T_left)."""

    k: Param[Scalar, "1/s"] = 2.0
    rates: Param[Vector, "K/s", shape(3)]
    T: Var[Vector, "K", shape(3)] = 0.0  # pyright: ignore[reportAssignmentType]

    def equations(self, d: Self) -> Equations:
        return dict(heat=eq(d.T, -self.k * (self.T - jnp.concatenate([jnp.zeros(1), self.T[:-1]])) + self.rates))


def test_arrays() -> None:
    linear = linearise(Rod(rates=jnp.ones(3)), inputs=["k"], outputs=["T"])
    assert linear.states == linear.outputs == ("T[0]", "T[1]", "T[2]")
    np.testing.assert_array_equal(linear.A, [[-2, 0, 0], [2, -2, 0], [0, 2, -2]])
    np.testing.assert_array_equal(linear.C, np.eye(3))
    with pytest.raises(ModelError, match="rates is an array of shape"):
        linearise(Rod(rates=jnp.ones(3)), inputs=["rates"])


@pytest.mark.thorough
def test_time_of_a_view() -> None:
    """The time is that of the view where a model has a clock, and can be given."""
    model = driven_capacitor(amplitude=3.0, frequency=2.0)
    outputs: dict[str, Callable[[Any], Any]] = {"square": lambda s: s.c.v**2}
    sol = simulate(model, 0.3)
    assert linearise(model, at=sol.final, outputs=outputs).outputs == ("square",)
    system = linearise(model, at=sol.final, outputs=outputs)
    assert float(system._point.t) == pytest.approx(0.3)  # pyright: ignore[reportOptionalMemberAccess]
    assert float(linearise(model, t=0.7)._point.t) == 0.7  # pyright: ignore[reportOptionalMemberAccess]


@pytest.mark.thorough
def test_no_states() -> None:
    model = Divider(source=ConstantVoltage(V=6.0), a=Resistor(R=1.0), b=Resistor(R=2.0))
    system = linearise(model, inputs=["source.V"], outputs=["b.v"])
    assert system.A.shape == (0, 0)
    assert len(system.poles) == len(system.zeros) == 0
    assert system.controllable
    assert system.observable
    for gain in (system.D, system.dc_gain, system.frequency_response(3.0), system.step_response(np.array([1.0]))[0]):
        np.testing.assert_allclose(gain, [[2.0 / 3.0]])
    assert system.transfer_function().numerator == pytest.approx([2.0 / 3.0])
    assert system.to_control().nstates == 0


def test_input_that_does_not_act() -> None:
    model = oscillator(m=1.0, c=4.0, d=0.4)
    system = linearise(model, inputs=["link.d", "link.s_rel0"], outputs=["mass.v"])
    np.testing.assert_array_equal(system.B[:, 0], 0.0)
    np.testing.assert_array_equal(system.dc_gain[0, 0], 0.0)
    assert not system.channel("mass.v", "link.d").controllable
    assert system.channel("mass.v", "link.s_rel0").controllable
    function = system.transfer_function("mass.v", "link.d")
    np.testing.assert_array_equal(function.numerator, [0.0])
    np.testing.assert_array_equal(function.denominator, [1.0])
    assert system.channel("mass.v", "link.d").minimal().A.shape == (0, 0)


def test_integrator_that_an_output_does_not_see() -> None:
    """The angle of a free shaft makes a pole at zero, which the speed does not see."""
    system = linearise(gear_train(2.0), inputs=["drive.torque"], outputs=["first.w", "first.a.phi"])
    assert np.all(np.isinf(system.dc_gain))
    damped = linearise(motor_rig(), inputs=["supply.V"], outputs=["motor.rotor.w", "motor.shaft.phi"])
    assert 0.0 in np.abs(np.array(damped.poles))
    np.testing.assert_allclose(damped.dc_gain[0, 0], K / (R * C + K**2), rtol=1e-12)
    assert np.isinf(damped.dc_gain[1, 0])
    assert not damped.channel("motor.rotor.w").observable
    assert damped.channel("motor.rotor.w").minimal().A.shape == (2, 2)


def test_zeros_of_a_vibration_absorber() -> None:
    """At the mass on which the force acts, the zeros are the poles of the rest with this mass held."""
    model = two_mass(m1=2.0, m2=1.0, c1=300.0, c2=100.0, d1=1.0, d2=2.0)
    system = linearise(model, inputs=["push.force"], outputs=["second.a.s", "first.a.s"])
    held = np.roots([2.0, 1.0 + 2.0, 300.0 + 100.0])
    np.testing.assert_allclose(system.channel("second.a.s").zeros, held[np.argsort(-held.imag)], rtol=1e-10)
    np.testing.assert_allclose(system.channel("first.a.s").zeros, [-50.0], rtol=1e-10)
    assert len(system.zeros) == 0
    np.testing.assert_allclose(system.dc_gain[:, 0], [1 / 300 + 1 / 100, 1 / 300], rtol=1e-12)


def test_zeros_of_several_channels() -> None:
    """A system of two inputs and outputs put together from given zeros, against the generalised eigenvalues."""
    rng = np.random.default_rng(0)
    A, B, C, D = (rng.normal(size=size) for size in ((5, 5), (5, 2), (2, 5), (2, 2)))
    base = linearise(oscillator(), inputs=["link.c", "link.d"], outputs=["mass.v", "mass.a.s"])
    full = eqx.tree_at(
        lambda s: (s.A, s.B, s.C, s.D), base._in_other_states((A, B, C)), tuple(map(jnp.asarray, (A, B, C, D)))
    )
    expected = np.linalg.eigvals(A - B @ np.linalg.solve(D, C))
    np.testing.assert_allclose(
        full.zeros, expected[np.lexsort((-expected.imag, np.abs(expected).round(12)))], rtol=1e-9
    )
    strict = eqx.tree_at(lambda s: s.D, full, jnp.zeros((2, 2)))
    for zero in strict.zeros:
        pencil = np.block([[A - zero * np.eye(5), B], [C, np.zeros((2, 2))]])
        assert np.linalg.svd(pencil, compute_uv=False)[-1] < 1e-10
    assert len(strict.zeros) == 3


@pytest.mark.thorough
def test_balanced_truncation() -> None:
    """The error of the frequency response stays within twice the sum of the singular values left out."""
    model = two_mass(c2=1e5, d1=10.0, d2=30.0)
    system = linearise(model, inputs=["push.force"], outputs=["second.a.s"])
    small, values = system.reduce(2), system.hankel_singular_values
    assert small.A.shape == (2, 2)
    assert np.all(np.diff(values) <= 0.0)
    ws = np.geomspace(0.1, 1e4, 400)
    error = np.abs(system.frequency_response(ws) - small.frequency_response(ws)).max()
    assert 0.01 * values[2] < error <= 2.0 * values[2:].sum()
    same = system.reduce(4)
    np.testing.assert_allclose(same.frequency_response(ws), system.frequency_response(ws), rtol=1e-8)
    with pytest.raises(ModelError, match="order=5"):
        system.reduce(5)
    with pytest.raises(ModelError, match="stable poles"):
        linearise(two_mass(), inputs=["push.force"], outputs=["second.a.s"]).reduce(2)
    with pytest.raises(ModelError, match="has no components"):
        _ = small.energy


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        (dict(inputs=["suply.V"]), r"no parameter 'suply.V'. Did you mean supply.V"),
        (dict(inputs=["motor.rotor.w"]), r"motor.rotor.w is not a parameter"),
        (dict(inputs=[3]), r"inputs must be a name or a sequence of names"),
        (dict(outputs=["motor.rotor.x"]), r"no variable 'motor.rotor.x'. Did you mean motor.rotor"),
        (dict(outputs=["supply.V"]), r"supply.V is not a variable of the model. Did you mean supply.v"),
        (
            dict(outputs=[lambda s: s.motor.x]),
            r"outputs: DCMotor has no .* variable 'x'\. It has resistor, .*\. Its argument",
        ),
        (dict(outputs=[lambda s: jnp.ones(2)]), r"array of shape \(2,\)"),
        (dict(at=[1.0]), r"has 3 states: "),
        (dict(at="start"), r"at=str is not an operating point"),
    ],
)
def test_wrong_requests(keywords: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        linearise(motor_rig(), **keywords)


@pytest.mark.thorough
def test_wrong_operating_points() -> None:
    sol = simulate(rc(), 0.1)
    with pytest.raises(ModelError, match="The operating point has another structure"):
        linearise(motor_rig(), at=sol.final)
    with pytest.raises(ModelError, match="not one instant"):
        linearise(rc(), at=sol.values)
    with pytest.raises(ModelError, match="at=Solution"):
        linearise(rc(), at=sol)
    with pytest.raises(ModelError, match="to linearise has another structure"):
        linearise(rc(), system=choose_states(motor_rig()))
    with pytest.raises(ParameterError, match=r"r\.R must be nonnegative"):
        linearise(eqx.tree_at(lambda m: m.r.R, rc(), -1.0))
    with pytest.raises(SimulationError, match="contradict"):
        linearise(Pendulum(x=0.5, y=-1.0))


def test_input_whose_rate_matters() -> None:
    """A voltage across a capacitor: the current follows its rate of change, which has no place in A, B, C, D."""
    with pytest.raises(ModelError, match=r"signal.offset is in the constraint signal.sine"):
        linearise(driven_capacitor(), inputs=["signal.offset"])


def test_wrong_channels(motor: LinearSystem) -> None:
    with pytest.raises(ModelError, match=r"Name the output, one of motor\.rotor\.w, motor\.p\.i"):
        motor.transfer_function()
    with pytest.raises(ModelError, match=r"no input 'supply\.v'\. Did you mean supply\.V"):
        motor.channel("motor.p.i", "supply.v")
    with pytest.raises(ModelError, match="no signal 'supply'"):
        motor.unit("supply")
    with pytest.raises(ModelError, match="vector of seconds"):
        motor.step_response(1.0)


@pytest.mark.thorough
def test_plots(motor: LinearSystem) -> None:
    axes = motor.plot_bode()
    assert axes.shape == (2, 2)
    gain = axes[0, 0].lines[0]
    response = motor.frequency_response(2 * np.pi * gain.get_xdata())[:, 0, 0]
    np.testing.assert_allclose(gain.get_ydata(), 20.0 * np.log10(np.abs(response)))
    panels = motor.plot_step(np.linspace(0.0, 0.1, 5))
    assert [ax.get_ylabel() for ax in panels[:, 0]] == ["change [rad/s]", "change [A]"]
    np.testing.assert_allclose(
        panels[1, 1].lines[0].get_ydata(), motor.step_response(np.linspace(0.0, 0.1, 5))[:, 1, 1]
    )
    crosses = motor.plot_poles().lines[2]
    np.testing.assert_allclose(np.asarray(crosses.get_xdata()), motor.poles.real)
    with pytest.raises(ModelError, match="no channel to plot"):
        linearise(motor_rig()).plot_bode()


def test_start_values_whose_events_have_no_end_are_no_operating_point() -> None:
    """The message names the events."""
    with pytest.raises(SimulationError, match=r"Undoing has no operating point .* condition of (up|down) holds\."):
        linearise(Undoing())


@pytest.mark.thorough
def test_under_jit_and_vmap() -> None:
    def of(R: Scalar) -> LinearSystem:
        return linearise(motor_rig(R=R), inputs=["supply.V"], outputs=["motor.rotor.w"])

    batch = jax.jit(jax.vmap(of))(jnp.array([0.3, 0.6]))
    assert batch.A.shape == (2, 3, 3)
    for i, resistance in enumerate((0.3, 0.6)):
        one = jax.tree_util.tree_map(lambda x, i=i: x[i], batch)
        np.testing.assert_allclose(one.A, of(resistance).A, rtol=1e-14)
        np.testing.assert_allclose(batch.poles[i], of(resistance).poles, rtol=1e-10)
        np.testing.assert_allclose(one.dc_gain, of(resistance).dc_gain, rtol=1e-10)


@pytest.mark.slow
def test_derivative_at_a_moving_operating_point() -> None:
    """The pole of a charging rectifier at a given time, as a function of the resistance, in both modes."""

    def pole(resistance: Scalar) -> Any:
        model = rectifier(1.0, R=resistance)
        return linearise(model, at=simulate(model, 0.02, rtol=1e-9).final).poles[0].real

    difference = (pole(100.1) - pole(99.9)) / 0.2
    assert float(jax.jacfwd(pole)(100.0)) == pytest.approx(float(difference), rel=1e-5)
    assert float(jax.grad(pole)(100.0)) == pytest.approx(float(difference), rel=1e-5)

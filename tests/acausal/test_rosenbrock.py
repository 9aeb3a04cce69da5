"""Order, stability, derivatives and failure of the Rosenbrock methods, against closed forms."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from jaxtyping import Array, Float

from acausal import ParameterError, Scalar
from acausal._integrate.solvers import Rodas3P, Rodas5P
from acausal._integrate.solvers._rosenbrock import AbstractRosenbrock
from acausal._linear_solver import (
    LARGEST_INVERSE,
    LARGEST_SUM,
    Factors,
    factors_of,
    gauss_jordan_inverse,
    linear_solver,
)

Vector = Float[Array, " n"]
METHODS = [Rodas5P, Rodas3P]


class Problem(NamedTuple):
    f: Callable[[Any, Vector, Any], Vector]
    exact: Callable[[Any], Vector]
    mass: Any = None


# y' = y cos t, z' = -(1 + t) z^2
NON_AUTONOMOUS = Problem(
    lambda t, y, _: jnp.stack([y[0] * jnp.cos(t), -(1 + t) * y[1] ** 2]),
    lambda t: jnp.stack([jnp.exp(jnp.sin(t)), 1 / (1 + t + t**2 / 2)]),
)
# y' = y z, 0 = z^2 + log(y)^2 - 1
DAE = Problem(
    lambda t, y, _: jnp.stack([y[0] * y[1], y[1] ** 2 + jnp.log(y[0]) ** 2 - 1]),
    lambda t: jnp.stack([jnp.exp(jnp.sin(t)), jnp.cos(t)]),
    np.array([1.0, 0.0]),
)
# y' = -y^2 z, 0 = z e^t - y + g(t), in mixed rows: M = [[1, 0], [2, 0]]
MIXED = np.array([[1.0, 0.0], [2.0, 1.0]])


def _non_autonomous_dae(t, y, _):
    constraint = y[1] * jnp.exp(t) - y[0] - (1 + t) * jnp.exp(t) + 1 / (1 + t + t**2 / 2)
    return jnp.asarray(MIXED) @ jnp.stack([-(y[0] ** 2) * y[1], constraint])


NON_AUTONOMOUS_DAE = Problem(
    _non_autonomous_dae, lambda t: jnp.stack([1 / (1 + t + t**2 / 2), 1 + t]), MIXED @ np.diag([1.0, 0.0])
)
# Prothero & Robinson (1974): y' = -1e5 (y - sin t) + cos t
STIFF = Problem(lambda t, y, _: -1e5 * (y - jnp.sin(t)) + jnp.cos(t), lambda t: jnp.sin(t)[None])


def errors(solver: AbstractRosenbrock, problem: Problem, steps: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Largest error at t = 1, and of the dense output before it, for each number of equal steps."""
    ts = jnp.linspace(0.01, 1.0, 67)
    exact = jax.vmap(problem.exact)(ts)

    @jax.jit
    def run(dt):
        sol = diffrax.diffeqsolve(
            diffrax.ODETerm(problem.f),
            solver,
            0.0,
            1.0,
            dt,
            problem.exact(jnp.array(0.0)),
            saveat=diffrax.SaveAt(ts=ts),
            max_steps=max(steps) + 1,
        )
        assert sol.ys is not None
        error = jnp.max(jnp.abs(sol.ys - exact), axis=1)
        return error[-1], jnp.max(error)

    end, dense = zip(*[run(1 / n) for n in steps], strict=True)
    return np.array(end), np.array(dense)


def orders(errors: np.ndarray) -> np.ndarray:
    return np.log2(errors[:-1] / errors[1:])


@pytest.mark.thorough
@pytest.mark.parametrize("problem", [NON_AUTONOMOUS, DAE, NON_AUTONOMOUS_DAE], ids=["ode", "dae", "dae(t)"])
@pytest.mark.parametrize("method", METHODS)
def test_order_of_step_and_dense_output(method, problem):
    end, dense = errors(method(mass=problem.mass), problem, [16, 32, 64])
    order, dense_order = (5, 4) if method is Rodas5P else (3, 3)
    assert np.all(orders(end) > order - 0.35)
    assert np.all(orders(end) < order + 0.6)
    assert np.all(orders(dense) > dense_order - 0.45)


@pytest.mark.thorough
@pytest.mark.parametrize(("method", "bound", "order"), [(Rodas5P, 2e-11, 2.9), (Rodas3P, 2e-8, 1.9)])
def test_order_on_a_stiff_problem(method, bound, order):
    end, _ = errors(method(), STIFF, [16, 32, 64])
    assert end[0] < bound
    assert np.all(orders(end) > order)


@pytest.mark.parametrize("method", METHODS)
def test_tableau_is_consistent(method):
    tableau = method.tableau
    gamma = np.linalg.inv(np.eye(len(tableau.a)) / tableau.gamma - tableau.c)
    alpha = tableau.a @ gamma
    np.testing.assert_allclose(alpha.sum(1), tableau.alpha_sums, atol=2e-14)
    np.testing.assert_allclose(gamma.sum(1), tableau.gamma_sums, atol=2e-14)
    weights, beta = tableau.step @ gamma, (alpha + gamma).sum(1)
    conditions = [weights.sum(), weights @ beta, weights @ alpha.sum(1) ** 2, weights @ (alpha + gamma) @ beta]
    np.testing.assert_allclose(conditions, [1, 1 / 2, 1 / 3, 1 / 6], atol=1e-13)
    embedded = (tableau.step - tableau.error) @ gamma
    np.testing.assert_allclose([embedded.sum(), embedded @ beta], [1, 1 / 2], atol=1e-13)


def one_step(solver: AbstractRosenbrock, f: Callable, y0: Any, h: float = 0.1) -> tuple[Vector, Vector]:
    """End and error estimate of a step from t = 0."""

    @jax.jit
    def step(solver, y0):
        return solver.step(diffrax.ODETerm(f), jnp.array(0.0), jnp.array(h), y0, None, None, False)[:2]

    return step(solver, jnp.asarray(y0, dtype=float))


@pytest.mark.parametrize("method", METHODS)
def test_l_stable(method):
    y1, error = one_step(method(), lambda t, y, _: -1e8 * y, [1.0], h=1.0)
    assert abs(float(y1[0])) < 1e-6
    assert abs(float(error[0])) < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_algebraic_component_is_met_and_has_no_spurious_error(method):
    """z = y^2 along y' = 1, where the differential component is exact."""
    y1, error = one_step(
        method(mass=[1.0, 0.0]), lambda t, y, _: jnp.stack([jnp.ones(()), y[1] - y[0] ** 2]), [1.0, 1.0]
    )
    np.testing.assert_allclose(y1, [1.1, 1.21], rtol=1e-13)
    np.testing.assert_allclose(error, 0, atol=1e-13)


@pytest.mark.thorough
@pytest.mark.computing
def test_forms_of_the_mass_matrix_agree():
    def f(t, y, _):
        return NON_AUTONOMOUS.f(t, y, _)

    expected = one_step(Rodas5P(), f, [1.0, 1.0])
    for mass in (np.ones(2), np.eye(2)):
        np.testing.assert_allclose(one_step(Rodas5P(mass=mass), f, [1.0, 1.0]), expected, rtol=1e-13, atol=1e-16)
    mixed = one_step(Rodas5P(mass=MIXED), lambda t, y, _: jnp.asarray(MIXED) @ f(t, y, _), [1.0, 1.0])
    np.testing.assert_allclose(mixed, expected, rtol=1e-12, atol=1e-15)


def test_unrolled_stages_agree_with_scanned_ones():
    scanned, unrolled = [one_step(Rodas5P(mass=DAE.mass, unroll=unroll), DAE.f, [1.0, 1.0]) for unroll in (False, True)]
    np.testing.assert_allclose(unrolled, scanned, rtol=1e-12, atol=1e-14)


def test_units_do_not_matter():
    """The same step in scaled variables and equations, over the 21 decades from a volume flow to a stiffness."""
    size, unit = jnp.array([1e-9, 1e12]), jnp.array([1e8, 1e-7])
    expected, _ = one_step(Rodas5P(mass=DAE.mass), DAE.f, [1.0, 1.0])
    solver = Rodas5P(mass=unit * DAE.mass / size, nominal=size)
    scaled, _ = one_step(solver, lambda t, y, _: unit * DAE.f(t, y / size, _), size)
    np.testing.assert_allclose(scaled / size, expected, rtol=1e-12)


@pytest.mark.parametrize("n", [3, LARGEST_SUM, LARGEST_SUM + 1, LARGEST_INVERSE, LARGEST_INVERSE + 1])
@pytest.mark.parametrize(
    ("rows", "columns"), [((1, 1, 1), (1, 1, 1)), ((1e15, 1, 1), (1, 1, 1)), ((1, 1, 1), (1, 1e-20, 1e9))]
)
def test_pivots_follow_nominal_sizes(n, rows, columns):
    """The first row must not give the first pivot, whose 1e-12 would drown the other rows; units make it look large."""
    matrix = np.eye(n)
    matrix[:3, :3] = [[1e-12, 1, 0], [1, 1, 1], [1, 2, -1]]
    rows, columns = (np.pad(np.array(x, dtype=float), (0, n - 3), constant_values=1) for x in (rows, columns))
    x = np.arange(1.0, n + 1)
    solve = linear_solver(jnp.asarray(rows[:, None] * matrix * columns), nominal=jnp.asarray(1 / columns))
    np.testing.assert_allclose(solve(jnp.asarray(rows * (matrix @ x))) * columns, x, rtol=1e-13)


@pytest.mark.thorough
@pytest.mark.parametrize("n", [3, LARGEST_INVERSE + 1])
def test_linear_solver_derivatives(n):
    rng = np.random.default_rng(0)
    matrix, direction = jnp.asarray(rng.normal(size=(2, n, n)))
    b = jnp.asarray(rng.normal(size=n))

    def f(matrix):
        return jnp.sum(linear_solver(matrix)(b) ** 2)

    x = jnp.linalg.solve(matrix, b)
    exact = -2 * x @ jnp.linalg.solve(matrix, direction @ x)
    np.testing.assert_allclose(jax.jvp(f, (matrix,), (direction,))[1], exact, rtol=1e-8)
    np.testing.assert_allclose(jnp.sum(jax.grad(f)(matrix) * direction), exact, rtol=1e-8)


@pytest.mark.parametrize("n", [3, LARGEST_INVERSE + 1])
def test_batches_of_linear_systems(n):
    """Batches of matrices, of right-hand sides and of both, batches of batches, and reverse mode through them."""
    rng = np.random.default_rng(0)
    matrices, sides = jnp.asarray(rng.normal(size=(2, n, n))), jnp.asarray(rng.normal(size=(2, 4, n)))

    def solution(matrix, b):
        return linear_solver(matrix)(b)

    exact = np.linalg.solve(matrices[:, None], sides[..., None])[..., 0]
    of_sides = jax.vmap(solution, in_axes=(None, 0))
    both, nested = jax.vmap(solution)(matrices, sides[:, 0]), jax.vmap(of_sides)(matrices, sides)
    np.testing.assert_allclose(of_sides(matrices[0], sides[0]), exact[0], rtol=1e-9)
    np.testing.assert_allclose(jax.vmap(solution, in_axes=(0, None))(matrices, sides[0, 0])[0], exact[0, 0], rtol=1e-9)
    np.testing.assert_allclose(both, exact[:, 0], rtol=1e-9)
    np.testing.assert_allclose(nested, exact, rtol=1e-9)
    slopes = jax.grad(lambda b: jnp.sum(of_sides(matrices[0], b) ** 2))(sides[0])
    np.testing.assert_allclose(slopes, 2.0 * np.linalg.solve(matrices[0].T, exact[0].T).T, rtol=1e-8)


@pytest.mark.parametrize("integrals", [1, 2 * LARGEST_INVERSE])
@pytest.mark.parametrize("n", [0, 3, LARGEST_INVERSE])
def test_integrals_take_no_elimination(n, integrals):
    rng = np.random.default_rng(0)
    matrix = np.concatenate([rng.normal(size=(n + integrals, n)), np.zeros((n + integrals, integrals))], axis=1)
    matrix[n:, n:] = np.diag(1.0 + rng.uniform(size=integrals))
    b, factors = rng.normal(size=n + integrals), factors_of(jnp.asarray(matrix), n_integrals=integrals)
    assert isinstance(factors, Factors)
    assert len(factors.parts) == 1
    np.testing.assert_allclose(factors.solve(b), np.linalg.solve(matrix, b), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(factors.solve_transposed(b), np.linalg.solve(matrix.T, b), rtol=1e-9, atol=1e-12)


def test_a_step_with_integrals_is_that_without_knowing_of_them():
    def f(t, y, _):
        return jnp.array([y[1], -4.0 * y[0] - jnp.sin(t) * y[1], y[0] * y[1] + t])

    start = [1.0, 0.5, 0.0]
    known, unknown = (one_step(Rodas5P(n_integrals=n), f, start) for n in (1, 0))
    for one, other in zip(jax.tree.leaves(known), jax.tree.leaves(unknown), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)


def test_inverse_pivots_and_shows_singularity():
    permutation = np.eye(4)[[2, 0, 3, 1]] * 3
    np.testing.assert_array_equal(gauss_jordan_inverse(jnp.asarray(permutation)), np.linalg.inv(permutation))
    assert not np.isfinite(gauss_jordan_inverse(jnp.ones((2, 2)))).all()


@pytest.mark.parametrize(("unroll", "evaluations"), [(False, 2), (True, 8)])
def test_vector_field_is_compiled_twice_when_scanned(unroll, evaluations):
    solver = Rodas5P(unroll=unroll)
    jaxpr = jax.make_jaxpr(lambda y: one_step(solver, lambda t, y, _: jax.scipy.special.gammaln(y), y))(jnp.ones(2))
    assert str(jaxpr).count("lgamma") == evaluations


def reactor(t, y, stiffness):
    """y' = -y z (1 + t), 0 = z^3 + stiffness z - y; from y = 1 + stiffness, z = 1."""
    return jnp.stack([-y[0] * y[1] * (1 + t), y[1] ** 3 + stiffness * y[1] - y[0]])


def solve_reactor(stiffness: Scalar, dt0: float | None, **options) -> diffrax.Solution:
    y0 = jnp.stack([1.0 + stiffness, jnp.ones_like(stiffness)])
    solver = Rodas5P(mass=[1.0, 0.0])
    return diffrax.diffeqsolve(diffrax.ODETerm(reactor), solver, 0.0, 5.0, dt0, y0, args=stiffness, **options)


def crossing_time(stiffness: Scalar, adjoint: diffrax.AbstractAdjoint) -> Array:
    """When the reactor's y falls to 1/2."""
    sol = solve_reactor(
        stiffness,
        dt0=None,
        stepsize_controller=diffrax.PIDController(rtol=1e-9, atol=jnp.array([1e-9, 1e-10])),
        event=diffrax.Event(lambda t, y, args, **_: y[0] - 0.5, optx.Newton(1e-12, 1e-12)),
        adjoint=adjoint,
        max_steps=256,
    )
    assert sol.ts is not None
    return sol.ts[0]


def exact_crossing_time(stiffness: float) -> float:
    """From dy/y = -z (1 + t) dt and dy = (3 z^2 + s) dz: t + t^2/2 is the integral of (3 z^2 + s) / (z^4 + s z^2)."""
    z_end = np.roots([1, 0, stiffness, -0.5])
    z_end = float(z_end[np.abs(z_end.imag) < 1e-12].real[0])
    nodes, weights = np.polynomial.legendre.leggauss(60)
    z = (1 + z_end) / 2 + (1 - z_end) / 2 * nodes
    integral = (1 - z_end) / 2 * weights @ ((3 * z**2 + stiffness) / (z**4 + stiffness * z**2))
    return float(np.sqrt(1 + 2 * integral) - 1)


def exact_derivative(stiffness: float) -> float:
    h = 1e-3
    t = [exact_crossing_time(stiffness + k * h) for k in (-2, -1, 1, 2)]
    return (t[0] - 8 * t[1] + 8 * t[2] - t[3]) / (12 * h)


@pytest.mark.thorough
def test_event_time_and_its_forward_derivative():
    direct = diffrax.DirectAdjoint()
    time, slope = jax.jit(lambda s: jax.jvp(lambda s: crossing_time(s, direct), (s,), (jnp.ones(()),)))(2.0)
    np.testing.assert_allclose(time, exact_crossing_time(2.0), rtol=1e-9)
    np.testing.assert_allclose(slope, exact_derivative(2.0), rtol=2e-8)


@pytest.mark.thorough
def test_derivatives_of_the_discrete_solution():
    """On equal steps all modes differentiate the same map, so they agree to rounding, and with differences of it."""

    def final(stiffness):
        sol = solve_reactor(stiffness, dt0=0.5, adjoint=diffrax.DirectAdjoint(), max_steps=16)
        assert sol.ys is not None
        return sol.ys[-1] @ jnp.array([1e3, 1.0])

    forward = jax.jit(lambda s: jax.jvp(final, (s,), (jnp.ones(()),)))
    slope = forward(2.0)[1]
    np.testing.assert_allclose(jax.jit(jax.grad(final))(2.0), slope, rtol=1e-11)
    h = 1e-3
    far, near, near_, far_ = (forward(2.0 + k * h)[0] for k in (-2, -1, 1, 2))
    np.testing.assert_allclose((far - 8 * near + 8 * near_ - far_) / (12 * h), slope, rtol=1e-7)


@pytest.mark.thorough
def test_batch_of_event_times():
    stiffness = jnp.array([0.1, 2.0, 5.0])
    adjoint = diffrax.RecursiveCheckpointAdjoint()
    times, slopes = jax.jit(jax.vmap(jax.value_and_grad(lambda s: crossing_time(s, adjoint))))(stiffness)
    np.testing.assert_allclose(times, [exact_crossing_time(float(s)) for s in stiffness], rtol=1e-9)
    np.testing.assert_allclose(slopes, [exact_derivative(float(s)) for s in stiffness], rtol=1e-7)


@pytest.mark.slow
def test_member_of_a_batch_that_ends_early_keeps_its_derivative():
    """Its further steps have no length, so that the matrix of a DAE would be singular."""

    def final(stiffness):
        sol = solve_reactor(
            stiffness,
            dt0=None,
            stepsize_controller=diffrax.PIDController(rtol=1e-5, atol=1e-5),
            saveat=diffrax.SaveAt(ts=[1.0, 5.0]),
            max_steps=64,
        )
        assert sol.ys is not None
        return jnp.sum(sol.ys), sol.stats["num_steps"]

    slope = jax.jit(jax.vmap(jax.value_and_grad(final, has_aux=True)))
    (_, steps), slopes = slope(jnp.array([0.1, 20.0]))
    assert steps[0] != steps[1]
    for stiffness, expected in zip([0.1, 20.0], slopes, strict=True):
        np.testing.assert_allclose(slope(jnp.full(2, stiffness))[1], expected, rtol=1e-6)


@pytest.mark.thorough
def test_derivative_with_respect_to_the_mass():
    """m y' = -y has y(1) = exp(-1/m), and the derivative exp(-1/m) / m^2."""

    def final(m):
        sol = diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, y, _: -y),
            Rodas5P(mass=m[None]),
            0.0,
            1.0,
            0.02,
            jnp.ones(1),
            adjoint=diffrax.ForwardMode(),
        )
        assert sol.ys is not None
        return sol.ys[-1, 0]

    value, slope = jax.jvp(final, (jnp.array(2.0),), (jnp.ones(()),))
    np.testing.assert_allclose([value, slope], [np.exp(-0.5), np.exp(-0.5) / 4], rtol=1e-10)


@pytest.mark.thorough
def test_saved_steps_times_and_dense_output_agree():
    ts = jnp.linspace(0.0, 1.0, 9)

    @jax.jit
    def run():
        return diffrax.diffeqsolve(
            diffrax.ODETerm(DAE.f),
            Rodas5P(mass=DAE.mass),
            0.0,
            1.0,
            None,
            jnp.array([1.0, 1.0]),
            stepsize_controller=diffrax.PIDController(rtol=1e-8, atol=1e-8),
            saveat=diffrax.SaveAt(
                subs=[diffrax.SubSaveAt(ts=ts), diffrax.SubSaveAt(steps=True)],
                dense=True,
            ),
            max_steps=64,
        )

    sol = run()
    assert sol.ys is not None
    assert sol.ts is not None
    at_times, at_steps = sol.ys
    steps = int(sol.stats["num_accepted_steps"])
    assert steps > 3
    np.testing.assert_allclose(at_times, jax.vmap(DAE.exact)(ts), rtol=1e-6)
    np.testing.assert_allclose(jax.vmap(sol.evaluate)(ts), at_times, rtol=1e-12)
    np.testing.assert_allclose(jax.vmap(sol.evaluate)(sol.ts[1][:steps]), at_steps[:steps], rtol=1e-12)
    np.testing.assert_allclose(sol.evaluate(0.2, 0.7), sol.evaluate(0.7) - sol.evaluate(0.2), rtol=1e-12)


def adaptive(
    f: Callable, y0: Any, solver: AbstractRosenbrock | None = None, dt0: float = 0.1, max_steps: int = 64
) -> diffrax.Solution:
    return jax.jit(
        lambda y0: diffrax.diffeqsolve(
            diffrax.ODETerm(f),
            solver or Rodas5P(),
            0.0,
            1.0,
            dt0,
            y0,
            stepsize_controller=diffrax.PIDController(rtol=1e-6, atol=1e-6),
            max_steps=max_steps,
            throw=False,
        )
    )(y0)


def test_singular_matrix_ends_as_a_result():
    """0 = y - y does not determine y."""
    sol = adaptive(lambda t, y, _: 0 * y, jnp.ones(1), Rodas5P(mass=[0.0]), max_steps=16)
    assert sol.result == diffrax.RESULTS.max_steps_reached
    assert int(sol.stats["num_accepted_steps"]) == 0


@pytest.mark.parametrize("outside", [np.nan, np.inf])
def test_step_out_of_the_domain_is_retried(outside):
    """y' = 10 (1 - y^2) stays below one; the first step, of the whole range, does not."""
    sol = adaptive(lambda t, y, _: jnp.where(y > 1.01, outside, 10 * (1 - y**2)), jnp.zeros(1), dt0=1.0)
    assert sol.result == diffrax.RESULTS.successful
    assert int(sol.stats["num_rejected_steps"]) > 0
    assert sol.ys is not None
    np.testing.assert_allclose(sol.ys[-1], np.tanh(10.0), rtol=1e-5)


@pytest.mark.parametrize("y0", [1.0, np.ones((2, 2)), {"x": np.ones(2)}])
def test_state_must_be_a_flat_real_vector(y0):
    with pytest.raises(ParameterError, match="one flat vector of real numbers"):
        adaptive(lambda t, y, _: y, y0)


@pytest.mark.parametrize("mass", [np.ones(3), np.ones((2, 3)), np.ones((2, 2, 2))])
def test_mass_must_fit_the_state(mass):
    with pytest.raises(ParameterError, match=r"has the shape \(.*\), but the state has 2 entries: give it as \(2, 2\)"):
        adaptive(lambda t, y, _: -y, np.ones(2), solver=Rodas5P(mass=mass))


@pytest.mark.parametrize("mass", [None, jnp.array([3.0, 1.0, 0.0])])
def test_only_stiff_and_algebraic_components_are_corrected(mass: Any) -> None:
    """Slow components, of a rate far below 1 per step, are filtered out; fast and algebraic ones remain."""
    rates = jnp.array([1e-4, 1e8, 1e8])
    solver = Rodas5P(mass=mass)
    ones = jnp.ones(3)
    factors = factors_of(jnp.diag(solver.mass_times(ones) / solver.tableau.gamma + rates))
    np.testing.assert_allclose(solver.of_stiff(factors, ones), [0.0, 1.0, 1.0], atol=1e-6)

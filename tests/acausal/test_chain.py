"""Dependent variables that follow from others one equation at a time."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _mechanisms import Pendulum, PointOnRod

from acausal import Equations, Scalar, SimulationError, Var, choose_states, eq, simulate
from acausal._evaluate.initial import ChainedStarts, given_pairs, initial_state
from acausal._evaluate.system import System


class SquaredRod(PointOnRod):
    """A pendulum with the squares of its coordinates as variables."""

    x: Var[Scalar, "m"] = 0.6
    y: Var[Scalar, "m"] = -0.7
    across: Var[Scalar, "m2"] = 0.0
    down: Var[Scalar, "m2"] = 0.0

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(
            across=eq(self.across, self.x**2),
            down=eq(self.down, self.y**2),
            rod=eq(self.across + self.down, self.L**2),
        )


def test_a_run_is_projected_in_its_states() -> None:
    model = SquaredRod(x=1.0, y=0.0)
    system = choose_states(model)
    assert set(system.state_names) == {"x", "y", "u", "v"}
    assert set(system.invariants.pairs) == set(system.states)
    assert len(system.invariants.names) == 2  # of 6 constraints
    sol = simulate(model, 0.5, rtol=1e-9, save="end", system=system)
    np.testing.assert_allclose(sol.final.across + sol.final.down, 1.0, rtol=1e-12)
    # The angle as an elliptic function of time: see the pendulum in test_index_reduction.py.
    np.testing.assert_allclose(np.asarray(sol.final.x), 0.391048791551, rtol=1e-8)


def left_at_the_start(model: SquaredRod, system: System) -> tuple[set[str], int]:
    """The variables of the start, and the number of its constraints."""
    rest = ChainedStarts(system, given_pairs(system, system.pack(model))).remaining
    return {system.ordered.table.variable_name(*pair) for pair in rest.pairs}, len(rest.names)


def test_a_start_is_searched_in_the_states() -> None:
    system = choose_states(SquaredRod())
    assert left_at_the_start(SquaredRod(), system) == ({"x", "y", "u", "v"}, 2)
    start = simulate(SquaredRod(), 0.0, save="end", system=system).final
    np.testing.assert_allclose(jnp.stack([start.x, start.y]), np.array([0.6, -0.7]) / np.hypot(0.6, 0.7), rtol=1e-9)
    np.testing.assert_allclose(jnp.stack([start.across, start.down]), jnp.stack([start.x**2, start.y**2]), rtol=1e-12)


def test_a_given_dependent_variable_stays_among_those_searched() -> None:
    model = SquaredRod(across=0.25)
    system = choose_states(model)
    assert left_at_the_start(model, system) == ({"x", "y", "u", "v", "across"}, 3)
    start = simulate(model, 0.0, save="end", system=system).final
    np.testing.assert_allclose(jnp.stack([start.x, start.y, start.down]), [0.5, -np.sqrt(0.75), 0.75], rtol=1e-9)
    with pytest.raises(SimulationError, match="x cannot have the value it is given"):
        simulate(SquaredRod(x=0.6, across=0.25), 0.0)


def test_the_start_does_not_grow_with_dependent_variables() -> None:
    def operations(model: PointOnRod) -> int:
        system = choose_states(model)
        return count(jax.make_jaxpr(lambda inputs: initial_state(system, 0.0, inputs))(system.pack(model)).jaxpr)

    # Two dependent variables and their derivatives take few operations in each copy of the constraints.
    assert operations(SquaredRod()) <= operations(Pendulum()) + 60


def count(jaxpr: Any) -> int:
    """The number of operations, including those within calls and loops."""
    inner = [getattr(value, "jaxpr", None) for eqn in jaxpr.eqns for value in eqn.params.values()]
    return len(jaxpr.eqns) + sum(count(part) for part in inner if part is not None and hasattr(part, "eqns"))

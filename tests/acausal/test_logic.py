"""Conditions as circuits: against python's own logic, over all truth values."""

import itertools
import operator
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal._reduce.event_indicators import (
    Expression,
    both,
    choice,
    circuit,
    differ,
    either,
    folded,
    literals_of,
    mapped,
    negation,
    relations,
)

N = 4


def _truth(a: Expression, truths: tuple[bool, ...]) -> bool:
    match a:
        case ("holds", k):
            return truths[k]
        case ("fails", k):
            return not truths[k]
        case ("and", first, second):
            return _truth(first, truths) and _truth(second, truths)
        case (_, first, second):
            return _truth(first, truths) or _truth(second, truths)
    raise AssertionError(a)


def _random(rng: np.random.Generator, depth: int) -> Expression:
    if depth == 0 or rng.random() < 0.2:
        return (str(rng.choice(["holds", "fails"])), int(rng.integers(N)))
    parts = [_random(rng, depth - 1) for _ in range(3)]
    return (negation(parts[0]), both(*parts[:2]), either(*parts[:2]), differ(*parts[:2]), choice(*parts))[
        rng.integers(5)
    ]


def test_operations_have_their_truth_tables() -> None:
    first, second, third = (("holds", k) for k in range(3))
    for truths in itertools.product([False, True], repeat=3):
        a, b, c = truths
        expected = {
            negation(first): not a, both(first, second): a and b, either(first, second): a or b,
            differ(first, second): a != b, choice(first, second, third): c if a else b,
        }  # fmt: skip
        assert [_truth(expression, truths) for expression in expected] == list(expected.values())


@pytest.mark.parametrize("relation", [operator.gt, operator.ge, operator.lt, operator.le])
@pytest.mark.parametrize(("a", "b"), [(1.0, 2.0), (2.0, 1.0), (2.0, 2.0), (0.0, 0.0)])
def test_a_margin_has_the_sign_of_its_relation_and_a_slope(relation: Any, a: float, b: float) -> None:
    """Also between equal numbers."""

    def margin(a: Any, b: Any) -> Any:
        found, _ = relations(jax.make_jaxpr(lambda a, b: relation(a, b))(a, b), [a, b])
        return found.indicators[0]

    assert (margin(jnp.asarray(a), jnp.asarray(b)) > 0.0) == relation(a, b)
    slope = 1.0 if relation in (operator.gt, operator.ge) else -1.0
    assert jax.grad(margin, (0, 1))(a, b) == (slope, -slope)


@pytest.mark.parametrize(
    "moved",
    [jnp.flip, jnp.copy, jnp.transpose, lambda x: x[::-1], lambda x: jnp.expand_dims(x, 0), lambda x: x.reshape(2, 2)],
)
def test_moved_truths_keep_their_relations(moved: Callable[[Any], Any]) -> None:
    x = jnp.array([-3.0, 2.0, 5.0, -7.0])
    found, (logic,) = relations(jax.make_jaxpr(lambda x: moved(x > 1.0))(x), [x])
    np.testing.assert_array_equal(np.concatenate(found.indicators), x - 1.0)
    expected = np.asarray(moved(np.arange(4)))
    assert logic.shape == expected.shape
    assert [number for _, number in logic.ravel()] == expected.ravel().tolist()


@pytest.mark.parametrize("join", [jnp.stack, jnp.concatenate])
def test_joined_truths_keep_their_relations(join: Callable[[Any], Any]) -> None:
    x, y = jnp.array([-3.0, 2.0]), jnp.array([5.0, -7.0])
    found, (logic,) = relations(jax.make_jaxpr(lambda x, y: jnp.any(join([x > 1.0, y > 2.0])))(x, y), [x, y])
    np.testing.assert_array_equal(np.concatenate(found.indicators), [*(x - 1.0), *(y - 2.0)])
    assert literals_of(logic.item()) == {"holds": {0, 1, 2, 3}, "fails": set()}


@pytest.mark.parametrize("seed", range(20))
def test_a_circuit_has_the_truths_of_its_expressions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expressions = [_random(rng, int(rng.integers(4))) for _ in range(5)]
    made = circuit(expressions, N)
    for truths in itertools.product([False, True], repeat=N):
        margins = jnp.where(jnp.array(truths), 1.0, -1.0) * jnp.array(rng.uniform(0.1, 2.0, N))
        assert ((made(margins, -margins) > 0) == np.array([_truth(a, truths) for a in expressions])).all()


@pytest.mark.parametrize("seed", range(5))
def test_bounds_hold_for_all_that_lies_between(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expressions = [_random(rng, 3) for _ in range(5)]
    made = circuit(expressions, N)
    low = rng.normal(size=N)
    high = low + rng.exponential(size=N)
    least, most = made(jnp.array(low), -jnp.array(high)), made(jnp.array(high), -jnp.array(low))
    for _ in range(20):
        between = jnp.array(rng.uniform(low, high))
        value = made(between, -between)
        assert ((least <= value) & (value <= most)).all()


def test_arrays_of_expressions() -> None:
    relations = mapped(lambda k: ("holds", int(k)), np.arange(6).reshape(2, 3))
    folds = folded(both, relations, [1])
    assert [literals_of(a)["holds"] for a in folds] == [{0, 1, 2}, {3, 4, 5}]
    assert literals_of(folded(either, relations, [0, 1]).item())["holds"] == set(range(6))


def test_equal_parts_are_computed_once() -> None:
    shared = both(("holds", 0), ("holds", 1))
    made = circuit([either(shared, ("holds", 2)), either(shared, ("holds", 3))], N)
    assert [len(is_and) for is_and, _, _ in made.levels] == [1, 2]

"""Numbers and truth values that are compiled once are what they were."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal._compiled_once import compiled_once, truths_compiled_once
from acausal._indices import first_true


@pytest.mark.parametrize("of_run", [0.0, -3.5, np.inf, np.nan])
def test_values_stay_whatever_the_number(of_run: float) -> None:
    indices = jnp.array([-1, 0, 1, 2, 100_003, 2**40 + 1])
    np.testing.assert_array_equal(jax.jit(compiled_once)(indices, of_run), indices)
    for truths in itertools.product([False, True], repeat=3):
        found = jax.jit(truths_compiled_once)(of_run, *map(jnp.asarray, truths))
        assert tuple(map(bool, found)) == truths


def test_the_first_that_holds_of_several_masks() -> None:
    for flat in itertools.product([False, True], repeat=4):
        masks = [jnp.array(flat[0]), jnp.zeros(0, bool), jnp.array(flat[1:3]), jnp.array(flat[3:])]
        assert int(first_true(masks)) == next((i for i, holds in enumerate(flat) if holds), 4)


def test_what_several_read_is_compiled_in_one_place() -> None:
    """Six outputs of one long sum: XLA copies it into each of them, but not what has been divided."""

    def operations(x: float, *, is_once: bool) -> str:
        def function(x: jax.Array) -> list[jax.Array]:
            index = sum((jnp.where(x > k, 1, 0) for k in range(30)), start=jnp.asarray(0))
            index = compiled_once(index, x) if is_once else index
            return [jnp.where(index > k, x, float(k)) for k in range(6)]

        compiled = jax.jit(function).lower(jnp.asarray(x)).compile().as_text()
        assert compiled is not None
        return compiled

    assert operations(0.5, is_once=True).count("compare") < 0.5 * operations(0.5, is_once=False).count("compare")

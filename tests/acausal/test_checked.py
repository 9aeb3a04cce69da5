"""Checks of traced numbers: the message of a bad member of a batch, and batches without members."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc
from jax import Array

from acausal import Scalar, replace, simulate
from acausal._integrate.results.checked import checked

TEXTS = ["Zero.", "One.", "Two.", "Three.", "Four."]


@eqx.filter_jit
@jax.vmap
def doubled(x: Scalar, is_bad: Array, index: Array) -> Scalar:
    return checked(2.0 * x, is_bad, index, TEXTS)


@pytest.mark.parametrize("index", range(len(TEXTS)))
def test_the_message_is_that_of_a_bad_member(index: int) -> None:
    """The other members, which are fine, have any index."""
    indices = jnp.array([4, index, 9, 0])
    with pytest.raises(RuntimeError, match=TEXTS[index]):
        doubled(jnp.zeros(4), jnp.arange(4) == 1, indices)
    np.testing.assert_array_equal(doubled(jnp.ones(4), jnp.zeros(4, bool), indices), 2.0)


def test_of_several_bad_members_the_largest_index_counts() -> None:
    with pytest.raises(RuntimeError, match="Three"):
        doubled(jnp.zeros(4), jnp.array([True, True, False, True]), jnp.array([1, 3, 4, 2]))


def test_a_batch_without_members_is_fine() -> None:
    assert jnp.shape(doubled(jnp.zeros(0), jnp.zeros(0, bool), jnp.zeros(0, int))) == (0,)


def test_no_runs_have_no_results() -> None:
    def voltage(C: Scalar) -> Scalar:
        return simulate(replace(rc(), {"c.C": C}), 0.1, save="end").final.c.v

    for look in (voltage, jax.grad(voltage)):
        assert jnp.shape(eqx.filter_jit(jax.vmap(look))(jnp.zeros(0))) == (0,)

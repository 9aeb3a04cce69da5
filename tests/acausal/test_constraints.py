"""Points nearest to given ones at which constraints hold, as they are searched for."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from acausal._evaluate.constraints import find, found_at_once, loose_inverse


def searched(how: Callable[..., tuple[Array, Array]], right: list[float]) -> Any:
    """From (3, 0): two linear constraints that say the same of two variables, apart from their right-hand sides."""
    rows = jnp.array([[1.0, 2.0], [0.3, 0.6]])
    return how(lambda z: rows @ z - jnp.array(right), jnp.array([3.0, 0.0]), jnp.ones(2), loose_inverse)[0]


@pytest.mark.parametrize("how", [find, found_at_once])
def test_what_is_said_twice_holds(how: Callable[..., tuple[Array, Array]]) -> None:
    np.testing.assert_allclose(searched(how, [1.0, 0.3]), [2.6, -0.8], rtol=1e-12)


@pytest.mark.parametrize("how", [find, found_at_once])
def test_no_point_is_found_where_constraints_contradict_each_other(how: Callable[..., tuple[Array, Array]]) -> None:
    assert np.all(np.isnan(searched(how, [1.0, 5.0])))

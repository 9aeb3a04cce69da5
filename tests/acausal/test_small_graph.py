"""Small graphs against scipy, which takes over for large ones: the outcome must not depend on the size."""

import numpy as np
import pytest
from scipy.sparse import csgraph, csr_array

from acausal._reduce import graph


@pytest.mark.parametrize("seed", range(100))
def test_small_graphs_are_treated_as_scipy_treats_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 15, 2)
    k = rng.integers(0, 3 * max(n, m))
    rows, columns, others = rng.integers(0, n, k), rng.integers(0, m, k), rng.integers(0, n, k)
    between = csr_array((np.ones(k), (rows, columns)), shape=(n, m))
    matched = csgraph.maximum_bipartite_matching(between, perm_type="column")
    np.testing.assert_array_equal(graph.match(rows, columns, int(n), int(m)), matched)
    among = csr_array((np.ones(k), (rows, others)), shape=(n, n))
    count, label = csgraph.connected_components(among, directed=False)
    found = graph.connected(np.stack([rows, others], axis=1), int(n))
    assert found[0] == count
    np.testing.assert_array_equal(found[1], label)
    # Strongly connected sets are the same, whatever their numbers.
    count, label = csgraph.connected_components(among, directed=True, connection="strong")
    found = graph.strong_components(rows, others, int(n))
    assert found[0] == count == len(set(zip(found[1].tolist(), label.tolist(), strict=True)))

"""Linear differential-algebraic equations of any index, solved by SUNDIALS IDA.

The shuffle algorithm (Luenberger, `Time-invariant descriptor systems`, 1978) differentiates what is algebraic until
z' is determined. What it finds on the way are the constraints, hidden ones included; with them the index is 1.
"""

from typing import Any

import numpy as np
from _tableau import DERIVATIVES, Tableau
from sksundae.ida import IDA

NONE, SOME = 1e-9, 1e-4  # a singular value below the first is zero; one between them leaves the rank unclear


class SingularError(Exception):
    """The equations do not determine a solution."""


class UnclearError(Exception):
    """The numbers do not tell a rank."""


def _rank(sizes: Any) -> int:
    if np.any((sizes > NONE) & (sizes < SOME)):
        raise UnclearError(sizes)
    return int(np.sum(sizes >= SOME))


class Descriptor:
    """Constraints G z + H s = 0 with orthonormal rows G, and z' = P z + R s; s are the sources with derivatives."""

    def __init__(self, tableau: Tableau) -> None:
        self.all_sources = tableau.sources.all
        n, k = tableau.S.shape
        E, A = tableau.E, tableau.A
        S = np.concatenate([tableau.S, np.zeros((n, k * (DERIVATIVES - 1)))], axis=1)
        found = []
        for _ in range(DERIVATIVES):
            left, sizes, _ = np.linalg.svd(E)
            rank = _rank(sizes)
            if rank == n:
                break
            E, A, S = left.T @ E, left.T @ A, left.T @ S
            found.append((A[rank:], S[rank:]))
            differentiated = np.concatenate([np.zeros((n - rank, k)), S[rank:, :-k]], axis=1)
            E = np.concatenate([E[:rank], A[rank:]])
            A = np.concatenate([A[:rank], np.zeros((n - rank, n))])
            S = np.concatenate([S[:rank], differentiated])
        else:
            raise SingularError
        self.index = len(found)
        self.P, self.R = -np.linalg.solve(E, A), -np.linalg.solve(E, S)
        G, H = (np.concatenate(part) for part in zip(*found, strict=True))
        left, sizes, right = np.linalg.svd(G)
        rank = _rank(sizes)
        self.G, self.free = right[:rank], right[rank:]
        self.H = (left.T[:rank] / sizes[:rank, None]) @ H

    def missed(self, z: Any, t: float = 0.0) -> Any:
        """The residual of the constraints."""
        return self.G @ z + self.H @ self.all_sources(t)

    def nearest(self, z: Any, t: float = 0.0) -> Any:
        """The nearest point on the constraints."""
        return z - self.G.T @ self.missed(z, t)

    def start(self, rows: Any, values: Any, t: float = 0.0) -> Any:
        """The point on the constraints at which the rows have the values, which determine it and do not contradict."""
        known = np.concatenate([self.G, rows]), np.concatenate([-self.H @ self.all_sources(t), values])
        z, _, rank, _ = np.linalg.lstsq(*known, rcond=NONE)
        assert rank == len(z), "The start values do not determine the start."
        np.testing.assert_allclose(known[0] @ z, known[1], atol=1e-9, err_msg="The start values contradict each other.")
        return z

    def solve(self, z0: Any, times: Any, rtol: float = 1e-11) -> Any:
        """z at the times, the first of which is that of `z0`."""

        def rest(t: float, z: Any, rate: Any, residual: Any) -> None:
            s = self.all_sources(t)
            residual[:] = np.concatenate([self.free @ (rate - self.P @ z - self.R @ s), self.G @ z + self.H @ s])

        def slopes(t: float, z: Any, rate: Any, residual: Any, c: float, out: Any) -> None:
            out[:] = np.concatenate([c * self.free - self.free @ self.P, self.G])

        solver = IDA(rest, jacfn=slopes, rtol=rtol, atol=1e-2 * rtol, max_num_steps=1_000_000)
        rate = self.P @ z0 + self.R @ self.all_sources(times[0])
        return solver.solve(np.asarray(times), z0, rate).y

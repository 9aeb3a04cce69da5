"""Division of the steps of a run into pieces on which functions are polynomials, within a tolerance."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..._tracing import are_traced

N_NODES = 16  # values of a function on a piece; a narrower spike between two of them is missed
LEAST = 2.0**-40  # width of the shortest pieces, those of a jump, relative to their step
ROUNDING = 1e-14  # relative rounding error of a function of the variables
AT_ONCE = 64  # pieces evaluated together, which limits the memory

NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(N_NODES) / (N_NODES - 1))  # Chebyshev points, from 0 to 1
PLACES = np.linspace(0.0, 1.0, 201)  # at which the search evaluates a polynomial for its maximum


def _basis(x: np.ndarray) -> np.ndarray:
    return np.polynomial.chebyshev.chebvander(2.0 * x - 1.0, N_NODES - 1)


_COEFFICIENTS = np.linalg.inv(_basis(NODES))  # of Chebyshev polynomials, by values at the nodes
_MEANS = np.array([1.0 / (1.0 - k**2) if k % 2 == 0 else 0.0 for k in range(N_NODES)])  # of the Chebyshev polynomials
WEIGHTS = _MEANS @ _COEFFICIENTS  # of the mean of a polynomial (Clenshaw and Curtis, Numer. Math. 2, 1960)
_HALF = N_NODES // 2
ROUGH_WEIGHTS = _MEANS[:_HALF] @ _COEFFICIENTS[:_HALF]  # of the mean of the polynomial of half the degree
CURVE = _basis(PLACES) @ _COEFFICIENTS  # the polynomial at the places
TAIL = _COEFFICIENTS[-4:]  # the highest coefficients


class Pieces(NamedTuple):
    """Pieces of steps: the index of the step, where the piece begins and how wide it is, in shares of the step, and
    whether the row is used.
    """

    step: Any
    low: Any
    width: Any
    there: Any

    @property
    def shares(self) -> Any:
        """The nodes in shares of the step, [pieces, nodes]."""
        return self.low[:, None] + self.width[:, None] * NODES

    def halves(self, chosen: Any) -> "Pieces":
        """The halves of chosen pieces. Traced pieces keep their number of rows, so at most half may be chosen."""
        if are_traced(self, chosen):
            rows = jnp.argsort(~chosen, stable=True)[: len(self.step) // 2]
            there = jnp.arange(len(self.step)) < 2 * jnp.sum(chosen)
            xp: Any = jnp
        else:
            rows, there, xp = np.flatnonzero(chosen), np.ones(2 * np.sum(chosen), bool), np
        low, width = self.low[rows], 0.5 * self.width[rows]
        return Pieces(
            xp.repeat(self.step[rows], 2), xp.ravel(xp.stack([low, low + width], 1)), xp.repeat(width, 2), there
        )

    def with_more(self, count: Any, more: "Pieces", chosen: Any) -> "Pieces":
        """These pieces, `count` of which are used, and the chosen ones of some more, as far as there is room."""
        if not are_traced(self, more, chosen):
            return Pieces(*(np.concatenate([old, new[chosen]]) for old, new in zip(self, more, strict=True)))
        rows = jnp.where(chosen, count + jnp.cumsum(chosen) - 1, len(self.step))
        pairs = zip(self, more._replace(there=chosen), strict=True)
        return Pieces(*(old.at[rows].set(new, mode="drop") for old, new in pairs))


def whole_steps(count: Any, n: int, is_traced: bool) -> Pieces:
    """The first `count` of `n` steps as pieces, of a run that has at least one."""
    xp: Any = jnp if is_traced else np
    rows = -(-max(n, 2 * AT_ONCE) // (2 * AT_ONCE)) * 2 * AT_ONCE if is_traced else n
    step = xp.minimum(xp.arange(rows), xp.maximum(count - 1, 0))
    return Pieces(step, xp.zeros(rows), xp.ones(rows), xp.arange(rows) < count)


def room_for(n: int, is_traced: bool) -> Pieces:
    """Room for n traced pieces; no known pieces."""
    xp: Any = jnp if is_traced else np
    n = n if is_traced else 0
    return Pieces(xp.zeros(n, int), xp.zeros(n), xp.zeros(n), xp.zeros(n, bool))


def filled_up(pieces: Pieces) -> Pieces:
    """The pieces with unused rows up to a multiple of AT_ONCE."""
    more = -len(pieces.step) % AT_ONCE
    return Pieces(*((jnp if are_traced(x) else np).pad(x, (0, more)) for x in pieces))

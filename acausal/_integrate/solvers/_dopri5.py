"""A step of DOPRI5, with a dense output of the same form as that of Rodas5P."""

from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..._numbers import Numbers
from ._rosenbrock import State, VectorField, combine

_pair = diffrax.Dopri5.tableau
_n = _pair.num_stages
_a = np.stack([np.pad(row, (0, _n - len(row))) for row in ((), *_pair.a_lower)])
_times = np.array([0.0, *_pair.c])
_first, _last = np.eye(_n)[0], np.eye(_n)[-1]
_bend = np.array(
    [
        -12715105075 / 11282082432, 0, 87487479700 / 32700410799, -10690763975 / 1880347072,
        701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423,
    ]
)  # fmt: skip
_dense = np.stack([_first - _pair.b_sol, 2 * _pair.b_sol - _first - _last + _bend, -_bend])


class ExplicitStep(NamedTuple):
    """The end of a step, its error estimate, the data of its dense output (see `RosenbrockInterpolation`), and the
    difference of its last two stages, which belong to the same time: of their slopes, multiplied by the step size, and
    of their states.
    """

    end: State
    error: State
    info: dict[str, Array]
    slopes_apart: State
    states_apart: State


def dopri5_step(f: VectorField, t0: Numbers, h: Numbers, y0: State) -> ExplicitStep:
    """A step of size h.

    Sources: J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6, 19
    (1980); the dense output of order 4: E. Hairer, S. P. Nørsett and G. Wanner, Solving Ordinary Differential Equations
    I, section II.6.
    """

    def stage(stages: Array, numbered: Any) -> tuple[Array, None]:
        i, a, c = numbered
        new = h * f(t0 + c * h, y0 + combine(a, stages))
        return jax.lax.dynamic_update_index_in_dim(stages, new, i, axis=0), None

    u = jax.lax.scan(stage, jnp.zeros((_n, len(y0))), (np.arange(_n), _a, _times))[0]
    y1 = y0 + combine(_pair.b_sol, u)
    info = {"y0": y0, "y1": y1, "coeffs": jnp.stack([combine(row, u) for row in _dense])}
    return ExplicitStep(y1, combine(_pair.b_error, u), info, u[-1] - u[-2], combine(_a[-1] - _a[-2], u))

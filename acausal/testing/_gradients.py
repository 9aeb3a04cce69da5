"""Check of derivatives in both modes against central differences."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ._equations import Modes, OpenEquations, Params, quick
from ._points import Points

# Relative steps of central differences. Laws with a large curvature or a nearby kink need the small ones; laws with
# large rounding errors need the large one. A wrong derivative agrees with none of them.
STEPS = np.array([1e-5, 1e-6, 1e-7])
AGREE = 1e-5  # tolerance between a derivative and finite differences, relative to the terms
ROUNDING = 1e-13  # relative rounding error of the subtracted values
SAME = 1e-9  # tolerance between both modes of differentiation, relative to the terms
TERMS = ("stored energy", "dissipated power", "supplied power")


def gradient_problems(equations: OpenEquations, found: Points, seed: int) -> list[str]:
    """Wrong derivatives at the points found and at the start values."""
    draw = np.random.default_rng(seed)
    params, modes = equations.given(equations.component)
    z = np.concatenate([found.z, equations.starts()[None]])[:, :2]
    all_params, all_modes = (
        [np.concatenate([many, one[None]]) for many, one in zip(several, last, strict=True)]
        for several, last in ((found.params, params), (found.modes, modes))
    )
    z_way = np.maximum(equations.size, np.abs(z)) * draw.normal(size=z.shape)
    p_way = [_directions(value, draw) for value in all_params]
    weights = draw.normal(size=(len(z), len(equations.rows) + len(TERMS)))
    results = quick(_Derivatives(equations))(z, all_params, all_modes, z_way, p_way, weights)
    return _compared([*equations.rows, *TERMS], _Found(*(np.asarray(item) for item in results)))


def _directions(value: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    """Directions of variation of parameters, relative to their values; zero for infinite ones."""
    way = np.where(value == 0.0, 1.0, np.abs(value)) * draw.normal(size=value.shape)
    return np.where(np.isfinite(value), way, 0.0)


class _Found(NamedTuple):
    """Results at each point.

    `value` and `forward` are the laws and their derivatives in forward mode, `differences` the derivatives by central
    differences over each of `STEPS`, and `of` the sizes of the numbers that are subtracted for them. The terms of `one`
    and `other` have the same sum, the weighted derivatives, computed in forward mode and in reverse mode.
    """

    value: Array | np.ndarray
    forward: Array | np.ndarray
    differences: Array | np.ndarray
    of: Array | np.ndarray
    one: Array | np.ndarray
    other: Array | np.ndarray


class _Derivatives:
    """The derivatives at one point."""

    def __init__(self, equations: OpenEquations) -> None:
        self.equations = equations

    def laws(self, z: Array, params: Params, modes: Modes) -> Array:
        terms = jnp.stack(self.equations.energy(z[0], params, modes))
        return jnp.concatenate([self.equations.residual(z[0], z[1], params, modes), terms])

    def __call__(self, z: Array, params: Params, modes: Modes, z_way: Array, p_way: Params, weight: Array) -> _Found:
        law = lambda z, params: self.laws(z, params, modes)  # noqa: E731
        # Reverse mode is the transpose of forward mode, and both are compiled with one copy of the law.
        value, tangent = jax.linearize(law, z, params)
        forward = tangent(z_way, p_way)
        z_slope, p_slope = jax.linear_transpose(tangent, z, params)(weight)
        pairs = [(z_slope, z_way), *zip(p_slope, p_way, strict=True)]
        # An infinite parameter does not vary.
        reverse = [jnp.where(way == 0.0, 0.0, slope * way).ravel() for slope, way in pairs]

        def moved(share: Array | np.ndarray) -> Array:
            return law(z + share * z_way, [p + share * way for p, way in zip(params, p_way, strict=True)])

        both_ways = jax.vmap(moved)(np.concatenate([STEPS, -STEPS])) / (2.0 * np.tile(STEPS, 2)[:, None])
        ahead, behind = jnp.split(both_ways, 2)
        of = jnp.abs(ahead) + jnp.abs(behind)
        return _Found(value, forward, ahead - behind, of, weight * forward, jnp.concatenate(reverse))


def _compared(labels: list[str], found: _Found) -> list[str]:
    """Wrong derivatives at points; the last point is that of the start values."""
    is_infinite = np.isfinite(found.value[-1]) & ~np.isfinite(found.forward[-1])
    problems = [
        f"The derivative of {labels[i]} is not finite at the start values." for i in np.flatnonzero(is_infinite)
    ]
    forward, differences, of = found.forward[:-1, None], found.differences[:-1], found.of[:-1]
    size = np.maximum(np.abs(forward), np.abs(differences))
    error = np.abs(forward - differences)
    wrong = ~np.any(error <= AGREE * size + ROUNDING * of, axis=1)
    nearest = np.argmin(np.where(np.isnan(error), np.inf, error), axis=1)
    for i in np.flatnonzero(wrong.any(axis=0)):
        k = int(np.argmax(wrong[:, i]))
        numbers = f"{forward[k, 0, i]:.9g} in forward mode, {differences[k, nearest[k, i], i]:.9g} by differences"
        problems.append(f"The derivative of {labels[i]} is {numbers}.")
    # Reverse mode is the transpose of forward mode, so an error of that is reported once.
    return problems or _modes_differ(found)


def _modes_differ(found: _Found) -> list[str]:
    size = np.sum(np.abs(found.one), axis=1) + np.sum(np.abs(found.other), axis=1)
    one, other = np.sum(found.one, axis=1), np.sum(found.other, axis=1)
    wrong = np.isfinite(found.value).all(axis=1) & ~(np.abs(one - other) <= SAME * size)
    if not wrong.any():
        return []
    k = int(np.argmax(wrong))
    return [f"Its derivatives in forward and reverse mode differ: {one[k]:.9g} and {other[k]:.9g}."]

"""Random points that satisfy the equations of a component, with random parameters, in the modes that they imply."""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jax import Array

from .._declare.by_name import parameters, replace
from .._declare.component import Component
from .._declare.node import nodes_of
from .._declare.node_requirements import broken
from .._errors import ModelError
from ._equations import Modes, Opened, Params

ROUNDS = 8  # maximum number of mode changes
STEPS = 60  # maximum number of Newton steps
DRAWS = 4  # maximum number of sets of guesses
ENOUGH = 3  # at least one of this many guesses must lead to a point
MET = 1e-10  # tolerance of the residuals, relative to the terms of the equation


@dataclasses.dataclass(frozen=True)
class Points:
    """Stacks of points, parameters and modes, and which of them satisfy the equations in consistent modes."""

    z: np.ndarray
    params: Params
    modes: Modes
    ok: np.ndarray

    @property
    def are_few(self) -> bool:
        """Whether too few points satisfy the equations for a check."""
        return ENOUGH * int(self.ok.sum()) < len(self.ok)

    def or_else(self, others: "Points") -> "Points":
        """These points if they satisfy the equations, otherwise `others`, which have the same parameters."""

        def chosen(own: Array | np.ndarray, other: Array | np.ndarray) -> np.ndarray:
            return np.where(np.reshape(self.ok, (-1, *(1,) * (own.ndim - 1))), own, other)

        modes = [chosen(*pair) for pair in zip(self.modes, others.modes, strict=True)]
        return Points(chosen(self.z, others.z), self.params, modes, self.ok | others.ok)

    def those_ok(self) -> "Points":
        pick = lambda items: [item[self.ok] for item in items]  # noqa: E731
        return Points(self.z[self.ok], pick(self.params), pick(self.modes), self.ok[self.ok])


def random_points(opened: Opened, count: int, seed: int) -> Points:
    """Points near random guesses; the first with the given parameters, the others with random ones.

    New guesses are drawn if too few lead to points, because the component refuses many of them.
    """
    draw = np.random.default_rng(seed)
    variants = [opened.component] + [_varied(opened.component, draw) for _ in range(count - 1)]
    params, modes = _stacked(opened.given(variant) for variant in variants)

    def drawn() -> Points:
        return nearby(opened, Points(_guess(opened, count, draw), params, modes, np.ones(count, bool)))

    found = drawn()
    for _ in range(DRAWS - 1):
        if not found.are_few:
            break
        found = found.or_else(drawn())
    return found


def _guess(opened: Opened, count: int, draw: np.random.Generator) -> np.ndarray:
    guess = opened.size * draw.normal(size=(count, 3, opened.equations.n))
    for leaf in opened.equations.variables:
        if leaf.declaration.sign is not None:
            own = slice(leaf.first, leaf.first + leaf.count)
            guess[:, 0, own] = np.abs(guess[:, 0, own])
    return guess


def _stacked(given: Iterable[tuple[Params, Modes]]) -> tuple[Params, Modes]:
    all_params, all_modes = zip(*given, strict=True)
    params, modes = ([np.stack(item) for item in zip(*rows, strict=True)] for rows in (all_params, all_modes))
    return params, modes


def _varied(component: Component, draw: np.random.Generator, spread: float = 0.4) -> Component:
    """The component with other admissible parameters; a zero stays zero in half of the cases."""
    noise = {path: draw.normal() for path in parameters(component)}
    stay = {path: draw.random() < 0.5 for path in noise}
    for _ in range(6):
        values = {}
        for path, value in parameters(component).items():
            number = np.asarray(value)
            raised = 0.0 if stay[path] else spread * abs(noise[path])
            values[path] = np.where(number == 0.0, raised, number * np.exp(spread * noise[path]))
        varied = _replaced(component, values)
        if varied is not None:
            return varied
        spread /= 4.0
    return component


def _replaced(component: Component, values: dict[str, np.ndarray]) -> Component | None:
    """The component with other parameters; None if it refuses them."""
    try:
        varied = replace(component, values)
    except ModelError:
        return None
    return None if any(True for _, node in nodes_of(varied) for _ in broken(node)) else varied


def nearby(opened: Opened, guess: Points, fixed: np.ndarray | None = None) -> Points:
    """Points that satisfy the equations, near guesses; `fixed` components of a point stay."""
    z, params, modes, ok = guess.z, guess.params, guess.modes, guess.ok
    free = np.ones(3 * opened.equations.n, bool) if fixed is None else ~fixed
    scale = np.tile(opened.size, 3)
    before, stays, refused = opened.equations.quiet(len(z)), np.zeros(len(z), bool), np.zeros(len(z), bool)
    for _ in range(ROUNDS):
        z, ok = _newton(opened, z, params, modes, scale, free)
        # Modes may change each other until they are consistent; the variables follow in the next search.
        for i in range(ROUNDS):
            before, new, refused = opened.equations.happens(z[:, 0], params, modes, before)
            same = _alike(modes, new)
            stays, modes = same if i == 0 else stays, [np.asarray(value) for value in new]
            if same.all():
                break
        if stays.all():
            break
    return Points(z, params, modes, ok & stays & ~np.asarray(refused) & _in_range(opened, z))


def _alike(modes: Modes, others: Modes) -> np.ndarray:
    """For each point, whether all modes are equal."""
    same = [np.reshape(np.equal(a, b), (len(a), -1)).all(axis=1) for a, b in zip(modes, others, strict=True)]
    return np.all(same, axis=0) if same else np.asarray(True)


def _newton(
    opened: Opened, z: np.ndarray, params: Params, modes: Modes, scale: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Newton's method with steps of least norm, relative to `scale`: the last iterates, and which have converged."""
    for _ in range(STEPS):
        residual, slope, finite = _rows(opened, z, params, modes, scale)
        if np.max(np.abs(residual), initial=0.0) < 1e-3 * MET:
            break
        steps = np.zeros((len(z), 3 * opened.equations.n))
        for i in np.flatnonzero(finite):
            steps[i, free] = np.linalg.lstsq(slope[i][:, free], residual[i], rcond=1e-13)[0]
        z = z - np.reshape(scale * steps, z.shape)
    residual, _, finite = _rows(opened, z, params, modes, scale)
    return z, finite & (np.max(np.abs(residual), axis=1, initial=0.0) < MET)


def _rows(
    opened: Opened, z: np.ndarray, params: Params, modes: Modes, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals and Jacobian relative to the terms of each equation, and for which points they are finite."""
    residual, slope = opened.equations.linearised(z, params, modes)
    slope = slope * scale
    finite = np.all(np.isfinite(residual), axis=1) & np.all(np.isfinite(slope), axis=(1, 2))
    residual, slope = np.where(finite[:, None], residual, 0.0), np.where(finite[:, None, None], slope, 0.0)
    reach = np.maximum(scale, np.reshape(np.abs(z), (len(z), -1))) / scale
    size = np.sum(np.abs(slope) * reach[:, None, :], axis=2)
    size = np.where(size > 0.0, size, 1.0)
    return residual / size, slope / size[:, :, None], finite


def _in_range(opened: Opened, z: np.ndarray) -> np.ndarray:
    inside = np.ones(len(z), bool)
    for leaf in opened.equations.variables:
        if leaf.declaration.sign is not None:
            values = z[:, 0, leaf.first : leaf.first + leaf.count]
            inside &= np.all(leaf.declaration.sign.admits(values), axis=1)
    return inside

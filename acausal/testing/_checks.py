"""The checks of a component. Each raises `CheckFailed` with all problems found."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .._declare.component import Component
from .._reduce.flatten import flatten
from .._unit_check.model_units import unit_problems
from ._equations import Opened
from ._law import fail, names, solved
from ._points import Points, random_points

# Relative steps of central differences. Laws with a large curvature or a nearby kink need the small ones; laws with
# large rounding errors need the large one. A wrong derivative agrees with none of them.
STEPS = np.array([1e-5, 1e-6, 1e-7])
AGREE = 1e-5  # tolerance between a derivative and finite differences, relative to the terms
OF_DIFFERENCES = 1e-13  # relative rounding error of the subtracted values
SAME = 1e-9  # tolerance between both modes of differentiation, relative to the terms


def gradient_problems(opened: Opened, found: Points, seed: int) -> list[str]:
    """Wrong derivatives at the points found and at the start values."""
    draw, equations = np.random.default_rng(seed), opened.equations
    params, modes = opened.given(opened.component)
    z = np.concatenate([found.z, opened.starts()[None]])
    all_params, all_modes = (
        [np.concatenate([many, one[None]]) for many, one in zip(several, last, strict=True)]
        for several, last in ((found.params, params), (found.modes, modes))
    )
    z_way = np.maximum(opened.size, np.abs(z)) * draw.normal(size=z.shape)
    p_way = [_directions(value, draw) for value in all_params]

    def along(share: float) -> tuple[np.ndarray, np.ndarray]:
        """The laws a share of the way further, and their derivatives along it."""
        moved = [value + share * way for value, way in zip(all_params, p_way, strict=True)]
        return equations.forward(z + share * z_way, moved, all_modes, z_way, p_way)

    value, forward = along(0.0)
    ahead, behind = (np.stack([along(sign * step)[0] for step in STEPS], axis=1) for sign in (1.0, -1.0))
    ahead, behind = (values / (2.0 * STEPS[:, None]) for values in (ahead, behind))
    weight = draw.normal(size=value.shape)
    z_slope, p_slope = equations.reverse(z, all_params, all_modes, weight)
    pairs = [(z_slope, z_way), *zip(p_slope, p_way, strict=True)]
    # An infinite parameter does not vary.
    reverse = [np.reshape(np.where(way == 0.0, 0.0, slope * way), (len(z), -1)) for slope, way in pairs]
    of = np.abs(ahead) + np.abs(behind)
    results = _Found(value, forward, ahead - behind, of, weight * forward, np.concatenate(reverse, axis=1))
    return _compared(equations.rows, results)


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

    value: np.ndarray
    forward: np.ndarray
    differences: np.ndarray
    of: np.ndarray
    one: np.ndarray
    other: np.ndarray


def _compared(labels: list[str], found: _Found) -> list[str]:
    """Wrong derivatives at points; the last point is that of the start values."""
    is_infinite = np.isfinite(found.value[-1]) & ~np.isfinite(found.forward[-1])
    problems = [
        f"The derivative of {labels[i]} is not finite at the start values." for i in np.flatnonzero(is_infinite)
    ]
    forward, differences, of = found.forward[:-1, None], found.differences[:-1], found.of[:-1]
    size = np.maximum(np.abs(forward), np.abs(differences))
    error = np.abs(forward - differences)
    wrong = ~np.any(error <= AGREE * size + OF_DIFFERENCES * of, axis=1)
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


BALANCED = 1e-7  # tolerance of the power balance, relative to its largest term
ROUNDING = 1e-12  # tolerance relative to the usual size of its terms
CREEP = 1e-6  # tolerance of negative dissipation, relative to the largest one: sticking friction creeps


def check_component(
    component: Component,
    *,
    given: Mapping[str, object] | None = None,
    expected: Mapping[str, object] | None = None,
    rtol: float = 1e-6,
    atol: float = 1e-12,
    sizes: float | None = None,
    points: int = 8,
    seed: int = 0,
) -> None:
    """Check the units of a component, its law, its power balance and its gradients, without simulation.

    See `check_units`, `check_law` (if `expected` is given), `check_power_balance` and `check_gradients`. Raises
    `CheckFailed`, an `AssertionError`, with all problems.
    """
    problems = unit_problems(flatten(component))
    if expected is not None:
        problems += _law_problems(component, given or {}, expected, rtol, atol, sizes)
    opened = Opened(component, sizes)
    found, too_few = _found(opened, points, seed)
    if not too_few:
        problems += _balance_problems(opened, found) + gradient_problems(opened, found, seed)
    fail(component, problems + too_few)


def check_units(component: Component) -> None:
    """Check that the units of the equations and of the energy account agree with the declared ones."""
    fail(component, unit_problems(flatten(component)))


def check_law(
    component: Component,
    given: Mapping[str, object],
    expected: Mapping[str, object],
    *,
    rtol: float = 1e-6,
    atol: float = 1e-12,
    sizes: float | None = None,
) -> None:
    """Check values that the equations of a component determine from others, against closed forms or published data.

    `given` and `expected` name variables, discrete ones too, and derivatives, with one value or an array of them:
    `check_law(Inductor(L=2.0), {"der(i)": [1.0, 3.0]}, {"v": [2.0, 6.0]})`. See `solved`.
    """
    fail(component, _law_problems(component, given, expected, rtol, atol, sizes))


def _law_problems(
    component: Component,
    given: Mapping[str, object],
    expected: Mapping[str, object],
    rtol: float,
    atol: float,
    sizes: float | None,
) -> list[str]:
    found = solved(component, given, sizes=sizes)
    unknown = [name for name in expected if name not in found]
    known = names(Opened(component).equations) if unknown else []
    problems = [
        f"{name} does not follow from {', '.join(given) or 'the parameters'}: give more."
        if name in known
        else f"{name} is not a variable."
        for name in unknown
    ]
    for name in expected.keys() - set(unknown):
        want = np.broadcast_to(np.asarray(expected[name], float), np.shape(found[name]))
        wrong = ~np.isclose(found[name], want, rtol=rtol, atol=atol)
        for case in np.flatnonzero(wrong.ravel())[:3]:
            cases = [
                np.broadcast_to(np.asarray(value, float), np.shape(want)).ravel()[case] for value in given.values()
            ]
            where = ", ".join(f"{key} = {value:.6g}" for key, value in zip(given, cases, strict=True))
            problems.append(f"{name} is {found[name].ravel()[case]:.9g}, not {want.ravel()[case]:.9g}, where {where}.")
    return problems


def check_power_balance(component: Component, *, sizes: float | None = None, points: int = 8, seed: int = 0) -> None:
    """Check the energy account: power through the ports + supplied = d(stored)/dt + dissipated, dissipated >= 0.

    It must hold for any motion, and is evaluated at random points that satisfy the equations and their derivatives in
    time: the first with the given parameters, the others with random ones around them, each in the modes that
    its values imply. `sizes` is the size of all variables in SI units; by default, each has its nominal size.
    An active component, such as a negative resistance, must state its power as `supplied`.
    """
    opened = Opened(component, sizes)
    found, too_few = _found(opened, points, seed)
    fail(component, too_few or _balance_problems(opened, found))


def _balance_problems(opened: Opened, found: Points) -> list[str]:
    # With all variables of nominal size, the terms give the scale of rounding errors.
    anywhere = np.broadcast_to(opened.size, found.z.shape)
    balance, usual = (np.stack(opened.equations.balance(z, found.params, found.modes)) for z in (found.z, anywhere))
    ports, supplied, stored, dissipated = balance
    usual = np.nan_to_num(np.max(np.abs(usual), axis=0))
    rounding = BALANCED * np.max(np.abs(balance), axis=0) + ROUNDING * usual
    problems = []
    missing = np.abs(ports + supplied - stored - dissipated)
    if (missing > rounding).any():
        i = int(np.argmax(missing - rounding))
        problems.append(
            f"Power through its ports {ports[i]:.6g} W + supplied {supplied[i]:.6g} W is not the rate of stored "
            f"{stored[i]:.6g} W + dissipated {dissipated[i]:.6g} W, {_where(opened, found, i)}. Remedy: a flow is "
            "positive into the component; state in `energy` what is stored, dissipated or supplied."
        )
    if (dissipated < -rounding - CREEP * usual).any():
        i = int(np.argmin(dissipated))
        problems.append(
            f"It dissipates {dissipated[i]:.6g} W, {_where(opened, found, i)}: declare generated power as supplied."
        )
    return problems


def check_gradients(component: Component, *, sizes: float | None = None, points: int = 8, seed: int = 0) -> None:
    """Check the derivatives of the equations and of the energy account with respect to variables and parameters.

    In random directions, forward mode, reverse mode and central differences agree at the points of
    `check_power_balance`; at the start values, where laws often have kinks, both modes are finite if the law is.
    """
    opened = Opened(component, sizes)
    found, too_few = _found(opened, points, seed)
    fail(component, too_few or gradient_problems(opened, found, seed))


def _found(opened: Opened, points: int, seed: int) -> tuple[Points, list[str]]:
    """Random points that satisfy the equations, and a complaint if they are too few for a check."""
    found = random_points(opened, points, seed)
    count = int(found.ok.sum())
    too_few = (
        f"Its equations have solutions near only {count} of {points} random points. Remedy: if they do not "
        "contradict each other, give the size of its variables by `sizes`, or as `nominal` of the component."
    )
    return found.those_ok(), [too_few] if found.are_few else []


def _where(opened: Opened, found: Points, index: int, most: int = 16) -> str:
    """Parameters and variables at a point."""
    equations = opened.equations
    params = [leaf.path for leaf in equations.flat.leaves if leaf.declaration.role == "param"]
    values = [(name, value[index]) for name, value in zip(params, found.params, strict=True) if np.ndim(value) == 1]
    values += list(zip(names(equations)[: 2 * equations.n], found.z[index].ravel(), strict=False))
    texts = [f"{name} = {value:.4g}" for name, value in values]
    return "at " + ", ".join(texts[:most]) + (", ..." if len(texts) > most else "")

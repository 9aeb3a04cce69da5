"""The checks of a component, each of which raises `CheckFailed` with all that it found."""

from collections.abc import Mapping

import numpy as np

from .._declare.component import Component
from .._reduce.flatten import flatten
from .._unit_check.check import unit_problems
from ._equations import OpenEquations
from ._failed import fail
from ._gradients import gradient_problems
from ._law import names, solved
from ._points import Points, random_points

BALANCED = 1e-7  # largest error of the power balance, as a share of its largest term
ROUNDING = 1e-12  # and as a share of what its terms usually are
CREEP = 1e-6  # power that may be given back, as a share of what is dissipated: friction that sticks creeps


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
    """Check the units of a component, its law, its power balance and its gradients, by itself: nothing is simulated.

    See `check_units`, `check_law` (where `expected` is given), `check_power_balance` and `check_gradients`. Raises
    `CheckFailed`, an `AssertionError`, with all that is wrong.
    """
    problems = unit_problems(flatten(component))
    if expected is not None:
        problems += _law_problems(component, given or {}, expected, rtol, atol, sizes)
    equations = OpenEquations(component, sizes)
    found, too_few = _found(equations, points, seed)
    if not too_few:
        problems += _balance_problems(equations, found) + gradient_problems(equations, found, seed)
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
    """Check values that follow from others by the equations of a component: closed forms, or published ones.

    `given` and `expected` name variables and derivatives, with one value or an array of them:
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
    known = names(OpenEquations(component)) if unknown else []
    problems = [
        f"{name} does not follow from {', '.join(given) or 'the parameters'}: give more."
        if name in known
        else f"{name} is no variable."
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

    It has to hold for any motion, and is evaluated at random points that meet the equations and their derivatives in
    time: the first with the parameters that are given, the others with random ones around them, each in the modes that
    its values imply. `sizes` is the typical size of all variables in SI units; by default, each has its nominal size.
    What a component gives on purpose, as a negative resistance does, it has to state as `supplied`.
    """
    equations = OpenEquations(component, sizes)
    found, too_few = _found(equations, points, seed)
    fail(component, too_few or _balance_problems(equations, found))


def _balance_problems(equations: OpenEquations, found: Points) -> list[str]:
    # Where all variables have their typical sizes, the terms have the sizes that tell rounding from power.
    anywhere = np.broadcast_to(equations.size, found.z.shape)
    balance, usual = (
        np.stack([np.asarray(item) for item in equations.balance(z, found.params, found.modes)])
        for z in (found.z, anywhere)
    )
    ports, supplied, stored, dissipated = balance
    usual = np.nan_to_num(np.max(np.abs(usual), axis=0))
    rounding = BALANCED * np.max(np.abs(balance), axis=0) + ROUNDING * usual
    problems = []
    missing = np.abs(ports + supplied - stored - dissipated)
    if (missing > rounding).any():
        i = int(np.argmax(missing - rounding))
        problems.append(
            f"Power through its ports {ports[i]:.6g} W + supplied {supplied[i]:.6g} W is not the rate of stored "
            f"{stored[i]:.6g} W + dissipated {dissipated[i]:.6g} W, {_where(equations, found, i)}. Remedy: a flow is "
            "positive into the component; state in `energy` what is stored, dissipated or supplied."
        )
    if (dissipated < -rounding - CREEP * usual).any():
        i = int(np.argmin(dissipated))
        problems.append(
            f"It dissipates {dissipated[i]:.6g} W, {_where(equations, found, i)}: what gives energy supplies."
        )
    return problems


def check_gradients(component: Component, *, sizes: float | None = None, points: int = 8, seed: int = 0) -> None:
    """Check the derivatives of the equations and of the energy account with respect to variables and parameters.

    In random directions, forward mode, reverse mode and central differences agree at the points of
    `check_power_balance`; at the start values, where laws often bend, both modes are finite where the law is.
    """
    equations = OpenEquations(component, sizes)
    found, too_few = _found(equations, points, seed)
    fail(component, too_few or gradient_problems(equations, found, seed))


def _found(equations: OpenEquations, points: int, seed: int) -> tuple[Points, list[str]]:
    """Random points that meet the equations, and a complaint where there are too few to tell anything."""
    found = random_points(equations, points, seed)
    count = int(found.ok.sum())
    too_few = (
        f"Only at {count} of {points} random points could its equations be met. Remedy: if they do not contradict each "
        "other, give the typical size of its variables by `sizes`, or as `nominal` of the component."
    )
    return found.those_ok(), [too_few] if found.are_few else []


def _where(equations: OpenEquations, found: Points, index: int, most: int = 16) -> str:
    """Parameters and variables at a point."""
    params = [leaf.path for leaf in equations.flat.leaves if leaf.declaration.role == "param"]
    values = [(name, value[index]) for name, value in zip(params, found.params, strict=True) if np.ndim(value) == 1]
    values += list(zip(names(equations)[: 2 * equations.n], found.z[index].ravel(), strict=False))
    told = [f"{name} = {value:.4g}" for name, value in values]
    return "at " + ", ".join(told[:most]) + (", ..." if len(told) > most else "")

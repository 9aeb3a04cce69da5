"""The checks of a component. Each raises `CheckFailed` with all problems found."""

from collections.abc import Mapping

import numpy as np

from .._declare.component import Component
from .._reduce.flatten import flatten
from .._unit_check.model_units import unit_problems
from ._equations import OpenEquations
from ._failed import fail
from ._gradients import gradient_problems
from ._law import names, solved
from ._points import Points, random_points

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
    known = names(OpenEquations(component)) if unknown else []
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
    equations = OpenEquations(component, sizes)
    found, too_few = _found(equations, points, seed)
    fail(component, too_few or _balance_problems(equations, found))


def _balance_problems(equations: OpenEquations, found: Points) -> list[str]:
    # With all variables of nominal size, the terms give the scale of rounding errors.
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
            f"It dissipates {dissipated[i]:.6g} W, {_where(equations, found, i)}: declare generated power as supplied."
        )
    return problems


def check_gradients(component: Component, *, sizes: float | None = None, points: int = 8, seed: int = 0) -> None:
    """Check the derivatives of the equations and of the energy account with respect to variables and parameters.

    In random directions, forward mode, reverse mode and central differences agree at the points of
    `check_power_balance`; at the start values, where laws often have kinks, both modes are finite if the law is.
    """
    equations = OpenEquations(component, sizes)
    found, too_few = _found(equations, points, seed)
    fail(component, too_few or gradient_problems(equations, found, seed))


def _found(equations: OpenEquations, points: int, seed: int) -> tuple[Points, list[str]]:
    """Random points that satisfy the equations, and a complaint if they are too few for a check."""
    found = random_points(equations, points, seed)
    count = int(found.ok.sum())
    too_few = (
        f"Its equations have solutions near only {count} of {points} random points. Remedy: if they do not "
        "contradict each other, give the size of its variables by `sizes`, or as `nominal` of the component."
    )
    return found.those_ok(), [too_few] if found.are_few else []


def _where(equations: OpenEquations, found: Points, index: int, most: int = 16) -> str:
    """Parameters and variables at a point."""
    params = [leaf.path for leaf in equations.flat.leaves if leaf.declaration.role == "param"]
    values = [(name, value[index]) for name, value in zip(params, found.params, strict=True) if np.ndim(value) == 1]
    values += list(zip(names(equations)[: 2 * equations.n], found.z[index].ravel(), strict=False))
    texts = [f"{name} = {value:.4g}" for name, value in values]
    return "at " + ", ".join(texts[:most]) + (", ..." if len(texts) > most else "")

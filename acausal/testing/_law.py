"""The law of a component: values that its equations determine from given ones."""

import math
from collections.abc import Mapping

import numpy as np

from .._declare.component import Component
from .._errors import AcausalError, UnknownNameError, suggestion
from ._equations import Opened, OpenEquations
from ._points import Points, nearby


class CheckFailed(AcausalError, AssertionError):
    """A component has failed a check. The message lists all problems."""


def fail(component: Component, problems: list[str]) -> None:
    """Raise `CheckFailed` if there are problems."""
    if problems:
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise CheckFailed("\n".join([f"{type(component).__name__}: {count} found.", *problems]))


GUESSES = 3


def solved(component: Component, given: Mapping[str, object], *, sizes: float | None = None) -> dict[str, np.ndarray]:
    """Values that the equations of a component and their time derivatives determine from given ones.

    `given` names variables and derivatives, as in `{"w": 10.0, "der(w)": 2.0}`; a value may be an array of several
    cases, solved one by one. The result contains all determined variables, with derivatives as `der(w)` and
    `der(w, 2)`, and the discrete variables. These are the modes that the values imply, starting from the given ones,
    otherwise from the initial modes. `sizes` as in `check_power_balance`.

    Raises `UnknownNameError` for an unknown variable, and `CheckFailed` if there is no solution, or if an event changes
    a given discrete variable.
    """
    opened = Opened(component, sizes)
    equations = opened.equations
    places = {name: _place(opened, name) for name in given if name not in _modes(equations)}
    values = dict(zip(given, np.broadcast_arrays(*(np.asarray(value, float) for value in given.values())), strict=True))
    shape = np.shape(next(iter(values.values()), 0.0))
    cases = math.prod(shape)
    n, count = equations.n, cases * GUESSES
    guess = opened.size * np.random.default_rng(0).normal(size=(GUESSES, cases, 3, n))
    flat = guess.reshape(GUESSES, cases, 3 * n)
    for name, place in places.items():
        flat[..., place] = values[name].ravel()
    fixed = np.isin(np.arange(3 * n), list(places.values()))
    params, modes = ([np.broadcast_to(v, (count, *np.shape(v))) for v in all] for all in opened.given(component))
    for name in given.keys() - places.keys():
        modes[_modes(equations)[name]] = np.tile(values[name].ravel(), GUESSES)
    start = Points(flat.reshape(count, 3, n), params, modes, np.ones(count, bool))
    found = nearby(opened, start, fixed)
    held = {name: np.asarray(found.modes[i]).reshape(GUESSES, cases) for name, i in _modes(equations).items()}
    _check_found(component, {name: value.ravel() for name, value in values.items()}, found.ok, held)
    z = found.z.reshape(GUESSES, cases, 3 * n)
    scale = np.maximum(np.tile(opened.size, 3), np.abs(z[0]))
    follows = np.all(np.ptp(z, axis=0) <= 1e-6 * scale, axis=0)
    determined = {name: z[0, :, i] for i, name in enumerate(names(equations)) if follows[i]}
    determined |= {name: value[0] for name, value in held.items() if np.all(value == value[0])}
    return {name: value.reshape(shape) for name, value in determined.items()}


def _check_found(
    component: Component, given: Mapping[str, np.ndarray], ok: np.ndarray, held: Mapping[str, np.ndarray]
) -> None:
    """Raise `CheckFailed` for a case without a solution, or in which an event changes a given discrete variable."""

    def case_text(case: int) -> str:
        return ", ".join(f"{name} = {value[case]:g}" for name, value in given.items())

    if not ok.all():
        fail(component, [f"Its equations have no solution for {case_text(int(np.argmin(ok)) % (len(ok) // GUESSES))}."])
    for name in given.keys() & held.keys():
        changed = held[name] != given[name]
        if changed.any():
            guess, case = np.argwhere(changed)[0]
            fail(component, [f"An event sets {name} to {held[name][guess, case]:g} for {case_text(case)}."])


def names(equations: OpenEquations) -> list[str]:
    """The names of all variables, then those of their first and second derivatives."""
    formats = ("{}", "der({})", "der({}, 2)")
    return [form.format(name) for form in formats for name in equations.names]


def _modes(equations: OpenEquations) -> dict[str, int]:
    """The names of the scalar discrete variables, and the position of each among all discrete ones."""
    leaves = [leaf for leaf in equations.flat.own_leaves if leaf.declaration.role == "discrete"]
    return {leaf.path: i for i, leaf in enumerate(leaves) if leaf.stack + leaf.sizes == ()}


def _place(opened: Opened, name: str) -> int:
    equations = opened.equations
    known, cls = names(equations), type(opened.component).__name__
    if name in known:
        return known.index(name)
    if any(leaf.path == name and leaf.declaration.role == "param" for leaf in equations.flat.own_leaves):
        raise UnknownNameError(f"{name} of {cls} is a parameter, not a variable: set it in the component.")
    raise UnknownNameError(f"{cls} has no variable {name!r}.{suggestion(name, [*known, *_modes(equations)])}")

"""The law of a component: values that its equations determine from given ones."""

from collections.abc import Mapping

import numpy as np

from .._declare.component import Component
from .._errors import UnknownNameError, suggestion
from ._equations import OpenEquations
from ._failed import fail
from ._points import Points, nearby

GUESSES = 3


def solved(component: Component, given: Mapping[str, object], *, sizes: float | None = None) -> dict[str, np.ndarray]:
    """Values that the equations of a component and their time derivatives determine from given ones.

    `given` names variables and derivatives, as in `{"w": 10.0, "der(w)": 2.0}`; a value may be an array of several
    cases, solved one by one. The result contains all determined variables, with derivatives as `der(w)` and
    `der(w, 2)`. The modes are those that the values imply, starting from the
    initial modes. `sizes` as in `check_power_balance`.

    Raises `UnknownNameError` for an unknown variable, and `CheckFailed` if there is no solution.
    """
    equations = OpenEquations(component, sizes)
    places = {name: _place(equations, name) for name in given}
    values = np.broadcast_arrays(*(np.asarray(value, float) for value in given.values()))
    shape = np.shape(values[0]) if values else ()
    cases = int(np.prod(shape))
    n, count = equations.n, cases * GUESSES
    guess = equations.size * np.random.default_rng(0).normal(size=(GUESSES, cases, 3, n))
    flat = guess.reshape(GUESSES, cases, 3 * n)
    for place, value in zip(places.values(), values, strict=True):
        flat[..., place] = value.ravel()
    fixed = np.isin(np.arange(3 * n), list(places.values()))
    params, modes = ([np.broadcast_to(v, (count, *np.shape(v))) for v in all] for all in equations.given(component))
    start = Points(flat.reshape(count, 3, n), params, modes, np.ones(count, bool))
    found = nearby(equations, start, fixed)
    if not found.ok.all():
        case = int(np.argmin(found.ok)) % cases
        texts = ", ".join(f"{name} = {value.ravel()[case]:g}" for name, value in zip(places, values, strict=True))
        fail(component, [f"Its equations have no solution for {texts}."])
    z = found.z.reshape(GUESSES, cases, 3 * n)
    scale = np.maximum(np.tile(equations.size, 3), np.abs(z[0]))
    follows = np.all(np.ptp(z, axis=0) <= 1e-6 * scale, axis=0)
    return {name: z[0, :, i].reshape(shape) for i, name in enumerate(names(equations)) if follows[i]}


def names(equations: OpenEquations) -> list[str]:
    """The names of all variables, then those of their first and second derivatives."""
    formats = ("{}", "der({})", "der({}, 2)")
    return [form.format(name) for form in formats for name in equations.names]


def _place(equations: OpenEquations, name: str) -> int:
    known = names(equations)
    if name not in known:
        raise UnknownNameError(
            f"{type(equations.component).__name__} has no variable {name!r}.{suggestion(name, known)}"
        )
    return known.index(name)

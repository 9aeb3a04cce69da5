"""A model against its reference: translated, simulated, compared, and one gradient checked."""

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import jax
import numpy as np

from ..._declare.by_name import parameters, replace
from ..._errors import AcausalError, UnknownNameError
from ..._garbage import seldom_collected
from ..._integrate.results.solution import Solution
from ..._integrate.simulate import simulate
from .._deep_calls import deep_calls
from .._frontend.stored import stored_model
from .._signals import ModelicaSignals
from .._syntax.flat import FlatModelica
from .._translate.build import component
from .._translate.model import ModelicaModel
from .reference import TOLERANCE, Reference, deviation, interval, read_reference

Stage = Literal["front end", "translation", "run", "no reference", "differs", "agrees"]
RTOL = 1e-6
MOST_TIMES = 1500
MOST_STEPS = 1_000_000  # more than the time limit of a model allows
STEP = 1e-4  # of a difference, relative to the parameter
MATTERS = 1e-5  # least effect of a parameter, relative to the largest value of the signal
GRADIENT_TOLERANCE = 1e-3  # between a derivative and the difference


@dataclasses.dataclass
class Compared:
    """What became of a model: the last stage that it reached, or the one that it failed in, with the reason."""

    model: str
    stage: Stage
    reason: str = ""
    equations: int = 0
    seconds: float = 0.0
    deviations: dict[str, float] = dataclasses.field(default_factory=dict)
    gradient: str = ""  # "right", "wrong" with numbers, or why there is none


def compared(model: str, roots: Sequence[str | Path], folder: Path, *, gradient: bool) -> Compared:
    """One row of the table. `folder` is that of the model among the references."""
    start = time.monotonic()
    row = Compared(model, "front end")
    try:
        with seldom_collected(), deep_calls():
            flat = stored_model("", model, roots)
            row.stage, row.equations = "translation", len(flat.equations)
            made = component(flat)
        row.stage = "run"
        reference = read_reference(folder)
        times = _times(reference, folder)
        solution = simulate(made, times[-1], t0=times[0], rtol=RTOL, save=times, max_steps=MOST_STEPS)
        jax.block_until_ready(solution.ts)
        row.stage = "no reference" if reference is None else "differs"
        if reference is not None:
            row.deviations = _deviations(made, solution, reference, times)
            if max(row.deviations.values(), default=0.0) <= TOLERANCE:
                row.stage = "agrees"
        if gradient and row.stage == "agrees" and reference is not None:
            row.gradient = _gradient(flat, made, reference, times)
    except (AcausalError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        row.reason = f"{type(error).__name__}: {error}"
    row.seconds = time.monotonic() - start
    return row


def _times(reference: Reference | None, folder: Path) -> np.ndarray:
    """Times of the reference, or if there is none, of the interval of the reference run."""
    if reference is None:
        return np.linspace(*interval(folder), 101)
    times = np.unique(reference.times)
    places = np.linspace(0, len(times) - 1, min(len(times), MOST_TIMES)).astype(int)
    return times[np.unique(places)]


def _deviations(model: ModelicaModel, solution: Solution, reference: Reference, times: np.ndarray) -> dict[str, float]:
    """The deviation of each signal; infinite for one that the model does not have."""
    found, signals = {}, ModelicaSignals(model)
    for name, values in reference.signals.items():
        try:
            own = np.asarray(signals[name](solution))
        except UnknownNameError:
            found[name] = float("inf")
        else:
            found[name] = deviation(reference.times, values, times, own)
    return found


def _gradient(flat: FlatModelica, model: ModelicaModel, reference: Reference, times: np.ndarray) -> str:
    """Whether the derivative of a signal at the end by a parameter agrees with a difference."""
    signals = ModelicaSignals(model)
    kinds = {name: flat.variables.get(name.rpartition("[")[0] or name) for name in reference.signals}
    jumps = {name for name, variable in kinds.items() if variable is not None and variable.type != "Real"}
    sizes = {name: float(np.max(np.abs(x))) for name, x in reference.signals.items() if name not in jumps}
    for path, value in _parameters(model):
        for name, size in sizes.items():

            def end(x: Any, path: str = path, name: str = name) -> Any:
                changed = replace(model, {path: x})
                solution = simulate(changed, times[-1], t0=times[0], rtol=1e-8, save="end", max_steps=MOST_STEPS)
                return signals[name](solution)[-1]

            step = STEP * abs(value)
            difference = float((end(value + step) - end(value - step)) / (2.0 * step))
            if abs(difference * value) <= MATTERS * size:
                continue
            derivative = float(jax.jvp(end, (value,), (1.0,))[1])
            error = abs(derivative - difference) / max(abs(derivative), abs(difference))
            right = "right" if error <= GRADIENT_TOLERANCE else f"wrong: {derivative:.6g}, difference {difference:.6g}"
            return f"{right} (d {name} / d {path})"
    return "no parameter matters"


def _parameters(model: ModelicaModel) -> list[tuple[str, float]]:
    """Some scalar parameters that the model states by numbers."""
    found = [(path, float(value)) for path, value in parameters(model).items() if np.ndim(value) == 0]
    return [(path, value) for path, value in found if value != 0.0 and np.isfinite(value)][:6]

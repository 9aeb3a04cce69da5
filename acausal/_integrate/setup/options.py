"""Validation of the options of a run: an error for a known value, the result `bad_option` for a traced one."""

import dataclasses
import operator
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.fields import as_parameter
from ..._declare.history import Past
from ..._errors import ModelError, suggestion
from ..._evaluate.system import System
from ..._numbers import Numbers, Truth
from ..._tracing import known
from .schedule import tick
from .settings import RunNumbers

T = TypeVar("T")
SAVES = ("steps", "end", "dense")
HARMLESS = dict(t0=0.0, t1=0.0, dt0=1.0, dtmin=1e-14, dtmax=1.0, rtol=1e-6, times=0.0)  # options of an empty run


class Demand(NamedTuple):
    """A requirement on an option, its sentence for the error message, and the name of the option. `got` is the value
    for the error message, if it is known and not that of the whole option.
    """

    holds: Truth
    text: str
    name: str
    got: str | None = None


def number(value: object, name: str, unit: str = "s") -> Any:
    """Validates an option that is a single number. Raises `ParameterError` or `ModelError` for anything else."""
    if isinstance(value, float | int):
        return np.asarray(float(value))
    value = as_parameter(value, unit=unit, where=name)
    if jnp.ndim(value):
        raise ModelError(f"{name} must be one number, got an array of shape {jnp.shape(value)}: use jax.vmap for many.")
    return value


def instant(value: Any, name: str) -> Any:
    """Validates an option that is a time."""
    value = number(value, name)
    is_finite = known(abs(value) < np.inf)
    if is_finite is not None and not np.all(is_finite):
        raise ModelError(f"{name} must be a finite time in s, got {name}={_shown(known(value))}.")
    return value


def flag(value: object, name: str) -> bool:
    """Validates an option that is True or False."""
    if not isinstance(value, bool | np.bool_):
        raise ModelError(f"{name} must be True or False, known before the run, got {value!r}.")
    return bool(value)


def names_of(value: object, name: str) -> tuple[str, ...]:
    """Validates an option that is one name or several names."""
    found: tuple[Any, ...] = (
        (value,) if isinstance(value, str) else tuple(value) if isinstance(value, Iterable) else (None,)
    )
    if not all(isinstance(item, str) for item in found):
        raise ModelError(f"{name} must be a name or a sequence of names, got {value!r}.")
    return found


def count(value: Any, name: str) -> int:
    """Validates an option that is an integer of at least 1."""
    try:
        found = 0 if isinstance(value, bool) else operator.index(value)
    except (TypeError, jax.errors.ConcretizationTypeError):
        found = 0
    if found < 1:
        raise ModelError(f"{name} must be an integer of at least 1, known before the run, got {value!r}.")
    return found


def times_of(save: object) -> Array | None:
    """The times to save at; None if `save` is a name."""
    if isinstance(save, str):
        if save not in SAVES:
            raise ModelError(f'save={save!r} is not known: use "steps", "end", "dense" or an array of times.')
        return None
    times = as_parameter(save, unit="s", where="save")
    if jnp.ndim(times) != 1:
        raise ModelError(f"save must be an array of times with one axis, got one of shape {jnp.shape(times)}.")
    if not jnp.size(times):
        raise ModelError('save must name at least one time: use "end" for the end only.')
    return times


def kind_of(value: object, name: str, kind: type[T], example: str) -> T:
    """Validates an option that is an object of a class."""
    if not isinstance(value, kind):
        raise ModelError(f"{name}={value!r} is not valid: pass {example}.")
    return value


def one_of(value: object, name: str, known_ones: Mapping[Any, T]) -> T:
    """The value that a named choice stands for."""
    if not isinstance(value, str | None) or value not in known_ones:
        names = [repr(one) for one in known_ones]
        raise ModelError(f"{name}={value!r} is not known: use {' or '.join(names)}.{suggestion(str(value), names)}")
    return known_ones[value]


def demands(system: System, numbers: RunNumbers) -> list[Demand]:
    """The requirements on the numbers of a run."""
    t0, t1 = numbers.t0, numbers.t1
    found = [
        Demand(abs(t0) < np.inf, "t0 must be a finite time in s", "t0"),
        Demand(abs(t1) < np.inf, "t1 must be a finite time in s", "t1"),
        Demand(_is_positive(numbers.rtol), "rtol must be a positive number, such as 1e-6", "rtol"),
    ]
    if numbers.dt0 is not None:
        found.append(Demand(_is_positive(numbers.dt0), "dt0, the size of the first step in s, must be positive", "dt0"))
    if numbers.dtmin is not None:
        found.append(Demand(_is_positive(numbers.dtmin), "dtmin, a step in s, must be positive", "dtmin"))
    if numbers.dtmax is not None:
        found.append(Demand(_is_positive(numbers.dtmax), "dtmax, a step in s, must be positive", "dtmax"))
    if (times := numbers.times) is not None:
        low, high = (t0 <= t1) * t0 + (t1 < t0) * t1, (t0 <= t1) * t1 + (t1 < t0) * t0
        inside, ahead = (times >= low) & (times <= high), (times[1:] - times[:-1]) * (t1 - t0) >= 0.0
        outside, back = _first_false(times, inside), _first_false(times, ahead)
        got = f"{outside[0]} with t0={known(t0)} and t1={known(t1)}" if outside else None
        found.append(Demand(inside, "The times to save at must lie between t0 and t1", "times", got))
        got = f"{back[1]} after {back[0]}" if back else None
        text = "The times to save at must be in the order in which the run reaches them"
        found.append(Demand(ahead, text, "times", got))
    if (event := _lasting(system)) is not None:
        text = f"A run cannot go back in time, to t1 before t0, because it cannot undo the event {event}"
        found.append(Demand(t1 >= t0, text, "t1"))
    if numbers.past is not None:
        found.append(starts_after_past(system, numbers.past, t0, "start at that time, or pass resume=False"))
    return found


def starts_after_past(
    system: System, past: Past, t0: Numbers, remedy: str = "start at that time", name: str = "t0"
) -> Demand:
    """The requirement that a model with scheduled events does not start before the time of its start values."""
    text = f"The start values belong to a later time, and events before it have already fired: {remedy}"
    return Demand((t0 >= past.time - tick(past.time, t0)) | (not _counts_times(system)), text, name)


def check_starts_after_past(system: System, past: Past | None, t0: Numbers, name: str = "t0") -> None:
    """Raise `ModelError` for a known time before that of the start values."""
    if past is not None:
        _check(starts_after_past(system, past, t0, name=name), t0)


def _is_positive(value: Numbers) -> Truth:
    return (value > 0.0) & (value < np.inf)


def _counts_times(system: System) -> bool:
    """Whether a scheduled event changes a variable."""
    return system.events is not None and any(e.kind in ("at", "sample") and e.targets for e in system.events.entries)


def _lasting(system: System) -> str | None:
    """The first event that changes a variable irreversibly; None if there is none."""
    entries = () if system.events is None else system.events.entries
    return next(
        (entry.label(0) for entry in entries if (entry.targets and entry.kind != "hold") or entry.kind == "remember"),
        None,
    )


def check_known(system: System, numbers: RunNumbers) -> None:
    """Raise `ModelError` for known numbers that are invalid."""
    names = [field.name for field in dataclasses.fields(numbers) if field.name in HARMLESS]
    values = {name: None if getattr(numbers, name) is None else known(getattr(numbers, name)) for name in names}
    for name in names:
        if values[name] is None and getattr(numbers, name) is not None:
            values[name] = getattr(numbers, name)
    for demand in demands(system, dataclasses.replace(numbers, **values)):
        _check(demand, values[demand.name])


def _check(demand: Demand, value: Numbers | None) -> None:
    met = known(demand.holds)
    if met is not None and not np.all(met):
        raise ModelError(f"{demand.text}, got {demand.got or f'{demand.name}={_shown(value)}'}.")


def _first_false(times: Numbers, holds: Truth) -> list[float]:
    """The times from the first one on for which a mask is false; none if that is not known."""
    where, values = known(holds), known(times)
    if where is None or values is None or np.all(where):
        return []
    return np.asarray(values)[int(np.argmin(where)) :].tolist()


def _shown(value: Any) -> str:
    return f"{float(value):g}" if np.ndim(value) == 0 else str(np.asarray(value))


def violated_demands(system: System, numbers: RunNumbers) -> Array:
    """Mask of the demands that are not met."""
    return jnp.stack([~jnp.all(demand.holds) for demand in demands(system, numbers)])


def sentences(system: System, numbers: RunNumbers) -> tuple[str, ...]:
    """The sentences of the demands."""
    return tuple(f"{demand.text}." for demand in demands(system, numbers))


def harmless(numbers: RunNumbers, wrong: Array) -> RunNumbers:
    """The numbers, replaced by those of a run of zero length if they are wrong."""
    options = {name: getattr(numbers, name) for name in HARMLESS if getattr(numbers, name) is not None}
    safe: dict[str, Array] = {name: jnp.where(wrong, HARMLESS[name], value) for name, value in options.items()}
    return dataclasses.replace(numbers, **safe)

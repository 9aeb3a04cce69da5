"""Makes components of FMUs."""

import hashlib
import warnings
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from components.blocks import Input, Output

from ..._declare.annotations import Discrete, Param, Scalar, Var, Vector, shape
from ..._errors import ModelError
from ..._made_once import made_once
from .component import Calls, CoSimulation, ImportedFMU, Key, ModelExchange, SampleCalls
from .description import Description, ImportedVariable, read, size_of
from .functions import Functions, SampledFMU


def FMU(
    file: str | Path,
    *,
    step: float | None = None,
    outputs: tuple[str, ...] = (),
    differences: bool = False,
    **values: Any,
) -> Any:
    """A component that an FMU describes (FMI 2.0 or 3.0).

    Parameters, inputs, outputs and states of the FMU are attributes, as in `FMU("ball.fmu", h=2.0).g`. A name that
    Python cannot have is changed: `body.frame[1]` is `body_frame_1`. `help` of the component shows all of them. Inputs
    and outputs are signal ports. `values` are parameters and start values; otherwise those of the FMU hold. `outputs`
    names further variables to show, as the FMU writes them.

    *Model exchange*, the default: states, events and derivatives of the FMU are part of the model. Derivatives with
    respect to states and inputs are those of the FMU, which FMI calls directional. FMI has none with respect to
    parameters, and FMI 2.0 none of event indicators: with `differences=True`, differences are taken there, and
    everywhere for an FMU that has none. An event that sets states or the time of the next event has no derivatives.

    *Co-simulation*, with a `step` in s: the FMU integrates itself from sample to sample. It has no derivatives.

    Raises `ModelError` for a file that cannot be read or run here, and for names that the FMU does not have. Warns by
    `FMUWarning` of an FMU that may change at the end of steps.
    """
    path = Path(file).resolve()
    if not path.is_file():
        raise ModelError(f"There is no file {file}.")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    is_sampled = step is not None
    of = _described(path, digest, outputs, is_sampled)
    if not is_sampled:
        _check_steps(of, path.name)
    whole = {v.field for v in of.fixed}
    fixed = tuple(sorted((name, float(values.pop(name))) for name in whole & values.keys()))
    given = {"step": step, **values} if is_sampled else values
    return _component(class_of(Key(path, digest, outputs, fixed, differences, is_sampled)), given)


@made_once(maxsize=64)
def class_of(key: Key) -> type[ImportedFMU]:
    """The class of an FMU, with its variables as fields."""
    base = _base(key.is_sampled)
    of = _described(key.path, key.digest, key.outputs, key.is_sampled)
    fixed = list(({variable.field: float(variable.start) for variable in of.fixed} | dict(key.fixed)).values())
    if key.is_sampled:
        calls: Any = SampleCalls(SampledFMU(key.path, key.digest, of, fixed))
    else:
        calls = Calls(Functions(key.path, key.digest, of, fixed, key.differences))
    namespace = {"__module__": __name__, "__doc__": _text(of), "_key": key, "_of": of, "_calls": calls}
    return type(base)(key.path.stem, (base,), namespace | {"__annotations__": _fields(of, key.is_sampled)})


def _base(is_sampled: bool) -> Any:
    return CoSimulation if is_sampled else ModelExchange


@made_once(maxsize=64)
def _described(path: Path, digest: str, outputs: tuple[str, ...], is_sampled: bool) -> Description:
    """The description of an FMU, whose fields do not collide with those of its class."""
    del digest  # of the content of the file
    return read(path, [*dir(_base(is_sampled)), "states", "signs", "held", "outputs"], outputs)


class FMUWarning(UserWarning):
    """An FMU that this library cannot run as its author meant it."""


def _check_steps(of: Description, name: str) -> None:
    """Warn of an FMU that may change its discrete states at the end of steps."""
    exchange = of.raw.modelExchange
    if exchange is not None and exchange.needsCompletedIntegratorStep:  # FMPy inverts completedIntegratorStepNotNeeded
        warnings.warn(
            f"{name} may change its discrete states at the end of steps, as a delay does, which model exchange does "
            "not support here. Remedy: compare with co-simulation, FMU(..., step=...).",
            FMUWarning,
            stacklevel=3,
        )


def _fields(of: Description, is_sampled: bool) -> dict[str, Any]:
    """The annotations of the class."""
    shown = {v.field for v in of.outputs}
    fields: dict[str, Any] = {v.field: Param[_type(v), v.unit] for v in of.parameters}
    fields |= {v.field: tuple[Input, ...] if v.sizes else Input for v in of.inputs}
    fields |= {v.field: tuple[Output, ...] if v.sizes else Output for v in of.outputs}
    if is_sampled:
        arrays = {"held": of.n_inputs, "outputs": size_of(of.outputs)}
    else:
        arrays = {"signs": of.n_indicators}
        fields |= {v.field: _variable(v) for v in of.states if v.field not in shown}
        fields |= {"states": Var[Vector, "", shape(of.n_states)]} if of.n_states else {}
    return fields | {name: Discrete[Vector, "", shape(size)] for name, size in arrays.items() if size}


def _component(cls: Any, given: dict[str, Any]) -> ImportedFMU:
    """A component of the class, with the given values and otherwise those of the FMU."""
    of = cls._of
    values: dict[str, Any] = {v.field: v.start for v in of.parameters}
    values |= {v.field: _ports(Input, v, None) for v in of.inputs}
    values |= {v.field: _ports(Output, v, None) for v in of.outputs}
    if issubclass(cls, ModelExchange):
        for v in of.states:
            start = given.pop(v.field, v.start if v.is_given else None)
            values[v.field] = _ports(Output, v, start) if v.field in values else start
    return cls(**values | given)


def _type(variable: ImportedVariable) -> Any:
    return Vector if variable.sizes else Scalar


def _variable(variable: ImportedVariable) -> Any:
    options = (shape(*variable.sizes),) if variable.sizes else ()
    return Var[(_type(variable), variable.unit, *options)]


def _ports(kind: Any, variable: ImportedVariable, start: Any) -> Any:
    """A port for a scalar, or one for each element of an array in row order."""
    if not variable.sizes:
        return kind() if start is None else kind(value=start)
    if start is None:
        return tuple(kind() for _ in range(variable.count))
    return tuple(kind(value=value) for value in (jnp.ravel(start) if isinstance(start, Array) else np.ravel(start)))


def _text(of: Description) -> str:
    """The documentation of the class: the descriptions of the FMU and of its variables."""
    lines = [of.raw.description or of.raw.modelName, ""]
    for title in ("parameters", "inputs", "outputs", "states", "fixed"):
        for v in getattr(of, title):
            lines.append(f"- {title}: `{v.field}`{f' [{v.unit}]' if v.unit else ''} {v.description}".rstrip())
    return "\n".join(lines)

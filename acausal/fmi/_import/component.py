"""An FMU as a component: its class, with the FMU's variables as fields."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import jax.numpy as jnp
from jax import Array

from components.blocks import Output

from ..._declare.annotations import Discrete, Scalar, Time
from ..._declare.component import Component, Equation, eq
from .description import Description, ImportedVariable


@dataclasses.dataclass(frozen=True)
class Key:
    """Key of the class of an imported FMU: its file and the options of the import."""

    path: Path
    digest: str  # of the content of the file
    outputs: tuple[str, ...]
    fixed: tuple[tuple[str, float], ...]  # values of whole numbers, by attribute
    differences: bool
    is_sampled: bool


class ImportedFMU(Component, partial=True):
    """Base class of imported FMUs, for model exchange and for co-simulation.

    The discrete states of an FMU have numbers; `reached` is that of the present one.
    """

    t: Time[Scalar, "s"] = 0.0
    ended: Discrete[Scalar, "1"] = 0.0  # 1 if the FMU has asked to end the simulation
    _key: ClassVar[Key]
    _of: ClassVar[Description]
    _calls: ClassVar[Any]  # the functions of the FMU in JAX

    def _inputs(self) -> Array:
        values = [getattr(self, variable.field) for variable in self._of.inputs]
        return joined([port.value for item in values for port in (item if isinstance(item, tuple) else (item,))])

    def _parameters(self) -> Array:
        return joined([getattr(self, variable.field) for variable in self._of.parameters])

    def _equals(self, variable: ImportedVariable, values: Array, place: int) -> Equation:
        """A variable of the component is a part of an array."""
        own = getattr(self, variable.field)
        if isinstance(own, tuple):
            own = jnp.stack([port.value for port in own])
        part = values[place : place + variable.count]
        right = part[0] if not variable.sizes else jnp.reshape(part, jnp.shape(own))
        return eq(own.value if isinstance(own, Output) else own, right, check_units=False)

    def __reduce__(self) -> Any:
        return blank, (self._key,), dict(vars(self))


def blank(key: Key) -> ImportedFMU:
    """A component without values, into which a pickle is restored."""
    from .fmu import class_of

    return object.__new__(class_of(key))


def joined(parts: Sequence[Any]) -> Array:
    """Scalars and arrays in one flat array."""
    return jnp.concatenate([jnp.zeros(0), *(jnp.ravel(jnp.asarray(part, float)) for part in parts)])

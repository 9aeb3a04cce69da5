"""Systems that are read from a pickle: made again, and held against what they were when they were stored."""

from typing import Any

from .._errors import ModelError, listed
from .._reduce.flat_model import FlatModel

Declared = tuple[tuple[Any, ...], ...]


def declared_by(flat: FlatModel) -> Declared:
    """What the numbers of a model mean, in their order."""
    return tuple((leaf.path, leaf.declaration.role, leaf.declaration.unit, leaf.sizes) for leaf in flat.leaves)


def read(made: tuple[Any, tuple[Any, ...]], declared: Declared) -> Any:
    """The system that was made by a function and from what it is given, when its classes declared this.

    Raises `ModelError` where they do not any more: what is stored with a system is an array of numbers, which would be
    taken for others.
    """
    make, given = made
    system = make(*given)
    now = declared_by(system.flat)
    if now == declared:
        return system
    others = sorted({path for path, *_ in set(now) ^ set(declared)})
    what = (
        f"declare other parameters or variables, or other units: {listed(others)}" if others else "order them otherwise"
    )
    raise ModelError(f"The classes of {system.name} have changed since it was stored, and {what}.")

"""Systems in pickles: rebuilt, and compared with the stored declarations."""

from typing import Any

from .._errors import ModelError, listed
from .._reduce.flat_model import FlatModel

Declared = tuple[tuple[Any, ...], ...]


def declared_by(flat: FlatModel) -> Declared:
    """The declarations of the numbers of a model, in order."""
    return tuple((leaf.path, leaf.declaration.role, leaf.declaration.unit, leaf.sizes) for leaf in flat.leaves)


def read(made: tuple[Any, tuple[Any, ...]], declared: Declared) -> Any:
    """The system rebuilt by a function from its arguments, if its classes still declare the same.

    Raises `ModelError` if they do not: the numbers stored with a system would be misinterpreted.
    """
    make, arguments = made
    system = make(*arguments)
    now = declared_by(system.flat)
    if now == declared:
        return system
    others = sorted({path for path, *_ in set(now) ^ set(declared)})
    what = (
        f"declare other parameters or variables, or other units: {listed(others)}" if others else "order them otherwise"
    )
    raise ModelError(f"The classes of {system.name} have changed since it was stored, and {what}.")

"""Values of a jaxpr in C: the text of any of their elements, and the positions of these elements."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from .expressions import PRODUCT, SUM, Expression, number


@dataclasses.dataclass(frozen=True)
class Index:
    """Positions of elements in a flat array, for each pass of the loops over `variables`: one axis for each loop."""

    places: np.ndarray
    variables: tuple[str, ...]
    tables: "Tables"

    def through(self, places: np.ndarray) -> "Index":
        """The positions in another array, given for each position in this one."""
        return dataclasses.replace(self, places=np.ravel(places)[self.places])

    def expression(self) -> Expression:
        """An affine function of the loop variables if possible, otherwise a table lookup."""
        places, first = self.places, int(np.ravel(self.places)[0])
        steps = [int(np.take(places, 1, axis).flat[0]) - first if n > 1 else 0 for axis, n in enumerate(places.shape)]
        grids = np.indices(places.shape)
        if np.array_equal(places, first + sum((step * grid for step, grid in zip(steps, grids, strict=True)), start=0)):
            return _affine(first, steps, self.variables)
        name = self.tables.of(places, "i")
        return Expression(f"{name}[{_flat(self.variables, places.shape).text}]")

    @property
    def text(self) -> str:
        return self.expression().text


def _affine(first: int, steps: list[int], variables: tuple[str, ...]) -> Expression:
    pairs = zip(steps, variables, strict=True)
    terms = [variable if step == 1 else f"{step} * {variable}" for step, variable in pairs if step]
    if first or not terms:
        terms.insert(0, str(first))
    level = SUM if len(terms) > 1 or first < 0 else PRODUCT
    return Expression(" + ".join(terms).replace("+ -", "- "), level)


def _flat(variables: tuple[str, ...], shape: tuple[int, ...]) -> Expression:
    """The position of an element of an array of this shape."""
    steps = [math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
    return _affine(0, [step if n > 1 else 0 for step, n in zip(steps, shape, strict=True)], variables)


@dataclasses.dataclass(frozen=True)
class CValue:
    """A value of a jaxpr. `at` gives the text of an element; `cost` counts the operations in it. A whole variable or
    array has a `name`, known numbers have `known`.
    """

    shape: tuple[int, ...]
    kind: str
    at: Callable[[Index], Expression]
    cost: int = 0
    known: np.ndarray | None = None
    name: str = ""

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    def moved(self, places: np.ndarray) -> "CValue":
        """The elements at some positions, as an array with the shape of these."""
        if self.known is not None:
            return constant(np.ravel(self.known)[places])
        return CValue(places.shape, self.kind, lambda index: self.at(index.through(places)), self.cost)


def stored(name: str, shape: tuple[int, ...], kind: str, offset: str = "", *, is_array: bool = False) -> CValue:
    """A variable, or an array from an offset; only an array `is_array` may have a single element."""
    if math.prod(shape) == 1 and not offset and not is_array:
        return CValue(shape, kind, lambda index: Expression(name), name=name)

    def at(index: Index) -> Expression:
        place = index.expression()
        text = f"{offset} + {place.text}" if offset and place.text != "0" else offset or place.text
        return Expression(f"{name}[{text}]")

    return CValue(shape, kind, at, name="" if offset else name)


def constant(array: np.ndarray) -> CValue:
    """Known numbers: written where they are read, several different ones as a table."""
    known = np.asarray(array)
    kind = known.dtype.kind

    def at(index: Index) -> Expression:
        values = np.ravel(known)[index.places]
        first = np.ravel(values)[0]
        if np.array_equal(values, np.full(values.shape, first), equal_nan=kind == "f"):
            return number(first, kind)
        name = index.tables.of(known, kind)
        return Expression(f"{name}[{index.text}]")

    return CValue(known.shape, kind, at, 0, known)


class Tables:
    """The constant arrays of a file, each of them once."""

    def __init__(self) -> None:
        self._names: dict[tuple[str, bytes], str] = {}
        self.arrays: dict[str, tuple[np.ndarray, str]] = {}

    def of(self, array: np.ndarray, kind: str) -> str:
        """The name of an array with these elements."""
        flat = np.ravel(array)
        key = kind, flat.tobytes()
        if key not in self._names:
            self._names[key] = f"{'places' if kind == 'i' else 'table'}_{len(self._names) + 1}"
            self.arrays[self._names[key]] = flat, kind
        return self._names[key]

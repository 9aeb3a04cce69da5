"""A component between two power ports: a transformer or a gyrator with elements at its sides."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .power_ports import Local, Series, series
from .spans import SAME

ROUNDING = 1e-15  # relative size of entries of a response that are rounding errors


class TwoPort(NamedTuple):
    """A two-port with power counted into both ports: TF: e1 = modulus e2, f2 = -modulus f1; GY: e1 = modulus f2, e2 =
    -modulus f1.

    `first` and `second`: impedances in series at a port (`..._of_efforts`), or admittances across it.
    """

    kind: str
    modulus: float
    first: Series
    first_of_efforts: bool
    second: Series
    second_of_efforts: bool


def two_port(local: Local, i: int, j: int, parameters: Sequence[float]) -> TwoPort | None:
    """The form with the fewest elements and, among those, with values that are parameters of the component."""
    found = list(_forms(local, i, j))
    return min(found, key=lambda form: (_size(form), -_named(form, parameters)), default=None)


def _forms(local: Local, i: int, j: int) -> Iterator[TwoPort]:
    """The form for each choice of the dependent variable at a port: its effort or its flow."""
    for kind, of_efforts in (
        ("TF", (True, False)),
        ("TF", (False, True)),
        ("GY", (True, True)),
        ("GY", (False, False)),
    ):
        first, second = (("e", "f") if given else ("f", "e") for given in of_efforts)
        found = local.response([(first[0], i), (second[0], j)], [(first[1], i), (second[1], j)])
        if found is None:
            continue
        across, back = (np.array([matrix[a] for matrix in found]) for a in ((0, 1), (1, 0)))
        size = np.max(np.abs(across))
        if size == 0.0 or np.ptp(across) > SAME * size or np.max(np.abs(across + back)) > SAME * size:
            continue
        laws = [series(_clean([float(matrix[a, a]) for matrix in found], found)) for a in (0, 1)]
        if laws[0] is None or laws[1] is None:
            continue
        value = float(across[0])
        # With f1 = value f2, or f1 = value e2, the modulus is that of the inverse.
        modulus = value if of_efforts[0] else -1.0 / value
        yield TwoPort(kind, modulus, laws[0], of_efforts[0], laws[1], of_efforts[1])


def _clean(values: Sequence[float], found: list[np.ndarray]) -> list[float]:
    """The values, with rounding errors relative to the largest response set to zero."""
    size = max(float(np.max(np.abs(matrix))) for matrix in found)
    return [0.0 if abs(value) < ROUNDING * size else value for value in values]


def _size(form: TwoPort) -> int:
    return len(form.first) + len(form.second)


def _named(form: TwoPort, parameters: Sequence[float]) -> int:
    values = [value for law in (form.first, form.second) for value in (law.inertia, law.resistance, law.stiffness)]
    return sum(any(abs(value - known) <= 1e-6 * abs(known) for known in parameters) for value in values if value)

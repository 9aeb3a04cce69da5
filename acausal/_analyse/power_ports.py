"""The laws of a component at its power ports: efforts and flows related by transformers, gyrators and one-ports.

The component's equations are linearised, and d/dt becomes a number s: a matrix times the vector of efforts, flows and
inner variables is zero. Relations that hold for several values of s are structural.
"""

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from .._declare.component import Component
from .._declare.layout import with_leaves
from .._declare.node import Port, leaves_of
from .._numbers import Numbers
from .._reduce.flatten import children

SAME = 1e-7  # relative difference that counts as none
RANK = 1e-10  # relative size of a singular value that counts as zero


def equilibrated(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A matrix with rows and columns scaled so that all entries are near one, and the factors of the columns.

    The factors minimise the logarithms of the entries in the least-squares sense (Curtis and Reid, 1972): volumes of
    1e-14 then have the same size as pressures of 1.
    """
    rows, columns = np.nonzero(matrix)
    if not len(rows):
        return matrix.copy(), np.ones(matrix.shape[1])
    design = np.zeros((len(rows), sum(matrix.shape)))
    design[np.arange(len(rows)), rows] = 1.0
    design[np.arange(len(rows)), matrix.shape[0] + columns] = 1.0
    logs = np.linalg.lstsq(design, -np.log(np.abs(matrix[rows, columns])), rcond=None)[0]
    down, across = np.exp(logs[: matrix.shape[0]]), np.exp(logs[matrix.shape[0] :])
    return matrix * down[:, None] * across, across


def solution(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """The solution of equally many independent equations and unknowns; None for other ranks."""
    if matrix.shape[0] < matrix.shape[1] or np.linalg.matrix_rank(matrix, tol=RANK) < matrix.shape[1]:
        return None
    if matrix.shape[0] == matrix.shape[1]:
        # Elimination keeps zeros, which least squares would fill with rounding errors.
        return np.linalg.solve(matrix, right)
    found = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return found if np.max(np.abs(matrix @ found - right), initial=0.0) < SAME else None


def left_null(matrix: np.ndarray) -> np.ndarray:
    """Rows that multiply the matrix to zero."""
    if matrix.size == 0:
        return np.eye(matrix.shape[0])
    u, sizes, _ = np.linalg.svd(matrix)
    rank = int(np.sum(sizes > RANK * max(sizes[0], 1e-300)))
    return u[:, rank:].T


def independent(rows: np.ndarray) -> np.ndarray:
    """Independent rows that span the same space."""
    if rows.size == 0:
        return rows[:0]
    size = np.max(np.abs(rows), axis=0)
    size = np.where(size > 0.0, size, 1.0)
    _, sizes, vt = np.linalg.svd(rows / size)
    rank = int(np.sum(sizes > RANK * max(sizes[0], 1e-300))) if sizes[0] > RANK else 0
    return vt[:rank] * size


RATES = (0.37, 2.9, 31.0, 470.0)  # values of s in 1/s


class PowerPort(NamedTuple):
    """A port with an effort and a flow. `of_flow`: connected ports share the flow (mechanics), otherwise the effort."""

    name: str
    of_flow: bool
    domain: str
    across: str
    through: str


def power_ports(component: Component) -> Iterator[PowerPort]:
    """The ports with one across and one flow variable. The power is their product, or that of the flow and the
    derivative of the across variable.
    """
    for name, part in children(component, ""):
        if isinstance(part, Port) and (found := _power_port(name, part)):
            yield found


def _power_port(name: str, port: Port) -> PowerPort | None:
    leaves = list(leaves_of(port))
    across = [leaf.path for leaf in leaves if leaf.declaration.role == "var"]
    through = [leaf.path for leaf in leaves if leaf.declaration.role == "flow"]
    if len(across) != 1 or len(through) != 1:
        return None
    values = {across[0]: (2.0, 3.0), through[0]: (5.0, 7.0)}
    here, rates = (with_leaves(port, [values[leaf.path][i] for leaf in leaves]) for i in (0, 1))
    power: Any = here
    module = [part for part in type(port).__module__.split(".") if not part.startswith("_")]
    # 3 * 5 is a flow times the derivative of the across variable, such as torque and angle; otherwise its value counts.
    of_flow = abs(float(power.power(rates)) - 15.0) < 1e-9
    return PowerPort(name, of_flow, module[-1] if module else type(port).__name__, across[0], through[0])


class Local:
    """The equations of one component at the rates s: a matrix for each, with columns by variable.

    Efforts and flows have the columns ("e", i) and ("f", i) for port i; all others are inner ones.
    """

    def __init__(self, component: Component, ports: Sequence[PowerPort]) -> None:
        self.columns: list[Any] = []
        self.matrices: list[np.ndarray] = []
        residuals, values, names = _residuals(component)
        zeros = np.zeros(len(values))
        self.residual = np.asarray(residuals(values, zeros))
        by_value, by_rate = (np.asarray(jax.jacfwd(residuals, i)(values, zeros)) for i in (0, 1))
        # A component has an equation for each inner variable and for each port. If it has fewer, signals drive it,
        # which count as known.
        self.is_driven = by_value.shape[0] < len(names) - len(ports)
        known = list(_signals(component)) if self.is_driven else []
        kept = [i for i, name in enumerate(names) if name.rpartition(".")[0] not in known]
        self.columns = [_column(names[i], ports) for i in kept]
        self.values = {
            column: float(values[i])
            for i, column in zip(kept, self.columns, strict=True)
            if isinstance(column, tuple) and not (column[0] == "f" and ports[column[1]].of_flow)
        }
        flows = np.array([isinstance(c, tuple) and c[0] == "f" and ports[c[1]].of_flow for c in self.columns])
        for s in RATES:
            matrix = (by_value + s * by_rate)[:, kept]
            self.matrices.append(np.where(flows, matrix / s, matrix))

    def index(self, column: Any) -> int:
        return self.columns.index(column)

    def relations(self, chosen: Sequence[Any], which: int = 0) -> Float[np.ndarray, "relations chosen"]:
        """All relations between the chosen columns only, at one rate."""
        matrix, columns = equilibrated(self.matrices[which])
        places = [self.index(column) for column in chosen]
        others = np.delete(np.arange(len(self.columns)), places)
        rows = left_null(matrix[:, others]) @ matrix[:, places] / columns[places]
        return independent(rows)

    def merge(self, i: int, j: int, kept: str, sign: float) -> bool:
        """Join port j to port i if `kept` ("e" or "f") of j is `sign` times that of i; returns whether that is
        possible.

        The other variable of i becomes the sum of both, such as e_i + sign e_j.
        """
        other = "f" if kept == "e" else "e"
        a, b, c, d = (self.index(item) for item in ((kept, i), (kept, j), (other, i), (other, j)))
        scale = max(np.max(np.abs(self.matrices[0][:, c])), 1e-300)
        if np.max(np.abs(self.matrices[0][:, d] - sign * self.matrices[0][:, c])) > SAME * scale:
            return False
        for matrix in self.matrices:
            matrix[:, a] += sign * matrix[:, b]
        here = (other, i)
        if here in self.values and (other, j) in self.values:
            self.values[here] += sign * self.values[other, j]
        gone = [b, d]
        self.matrices = [np.delete(matrix, gone, axis=1) for matrix in self.matrices]
        self.columns = [column for number, column in enumerate(self.columns) if number not in gone]
        return True

    def ratio(self, kind: str, i: int, j: int) -> float | None:
        """The factor between `kind` ("e" or "f") of port i and that of port j; None if other variables enter."""
        found = self.relations([(kind, i), (kind, j)])
        if len(found) == 2:
            # A source sets both: the flow into one port leaves by the other.
            return -1.0
        if len(found) != 1 or abs(found[0, 1]) < SAME * abs(found[0, 0]) or abs(found[0, 0]) < SAME * abs(found[0, 1]):
            return None
        return float(-found[0, 0] / found[0, 1])

    def response(self, outputs: Sequence[Any], inputs: Sequence[Any]) -> list[np.ndarray] | None:
        """The matrix from inputs to outputs at each rate; None if it is not determined."""
        given = [self.index(column) for column in inputs]
        rest = [i for i in range(len(self.columns)) if i not in given]
        places = [rest.index(self.index(column)) for column in outputs]
        found = []
        for matrix in self.matrices:
            scaled, columns = equilibrated(matrix)
            found.append(solution(scaled[:, rest], -scaled[:, given]))
            if found[-1] is None:
                return None
            found[-1] = (found[-1] * columns[rest][:, None] / columns[given])[places]
        return found

    def law(self, output: Any, given: Any) -> "Series | None":
        """The law of a single port, from its input to its output."""
        found = self.response([output], [given])
        return None if found is None else series([float(matrix[0, 0]) for matrix in found])

    def offset(self, column: Any) -> float:
        """The effort or flow of a source."""
        scaled, columns = equilibrated(np.column_stack([self.matrices[0], self.residual]))
        solution = np.linalg.lstsq(scaled[:, :-1], -scaled[:, -1] / columns[-1], rcond=1e-10)[0] * columns[:-1]
        return float(solution[self.index(column)] + self.values.get(column, 0.0))


@dataclasses.dataclass(frozen=True)
class Series:
    """s inertia + resistance + stiffness / s, an impedance, or an admittance as the sum of parallel ones."""

    inertia: float
    resistance: float
    stiffness: float

    def __len__(self) -> int:
        return sum(value != 0.0 for value in (self.inertia, self.resistance, self.stiffness))


def series(values: Sequence[float]) -> Series | None:
    """The terms with these values at `RATES`; None if there are none."""
    s, target = np.array(RATES), np.asarray(values)
    size = np.max(np.abs(target), initial=0.0)
    if size == 0.0 or not np.all(np.isfinite(target)):
        return Series(0.0, 0.0, 0.0) if size == 0.0 else None
    terms = np.stack([s, np.ones_like(s), 1.0 / s], axis=1)
    # Each value with its own relative accuracy.
    weight = 1.0 / np.maximum(np.abs(target), 1e-12 * size)
    for count in (1, 2, 3):
        for chosen in itertools.combinations(range(3), count):
            part = terms[:, chosen] * weight[:, None]
            columns = np.max(np.abs(part), axis=0)
            solution = np.linalg.lstsq(part / columns, target * weight, rcond=None)[0] / columns
            if np.max(np.abs(terms[:, chosen] @ solution - target) * weight) < SAME:
                full = np.zeros(3)
                full[list(chosen)] = solution
                return Series(*full.tolist())
    return None


def _residuals(component: Component) -> tuple[Callable[[Any, Any], Any], np.ndarray, list[str]]:
    """The residuals as a function of variables and their derivatives; the variables' values and names."""
    leaves = list(leaves_of(component))
    variables = [i for i, leaf in enumerate(leaves) if leaf.declaration.role in ("var", "flow")]
    shapes = [np.shape(leaves[i].value) for i in variables]
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    names = [leaves[i].path for i, shape in zip(variables, shapes, strict=True) for _ in range(int(np.prod(shape)))]
    values = np.concatenate([np.ravel(np.asarray(leaves[i].value, float)) for i in variables] or [np.zeros(0)])

    def placed(x: Numbers, rest: Any) -> Any:
        new = list(rest)
        for i, piece, shape in zip(variables, jnp.split(x, ends[:-1]), shapes, strict=True):
            new[i] = piece.reshape(shape)
        return with_leaves(component, new)

    given = [jnp.asarray(leaf.value, float) for leaf in leaves]

    def residuals(x: Numbers, rates: Numbers) -> Array:
        here, slopes = placed(x, given), placed(rates, given)
        equations = here.equations(slopes) | here.shared_equations(slopes)
        return jnp.concatenate([jnp.ravel(jnp.asarray(item.residual, float)) for item in equations.values()])

    return residuals, values, names


def _signals(component: Component) -> Iterator[str]:
    """The ports without power."""
    for name, part in children(component, ""):
        if isinstance(part, Port) and not _power_port(name, part):
            yield name


def _column(name: str, ports: Sequence[PowerPort]) -> Any:
    for i, port in enumerate(ports):
        if name == f"{port.name}.{port.across}":
            return ("f" if port.of_flow else "e", i)
        if name == f"{port.name}.{port.through}":
            return ("e" if port.of_flow else "f", i)
    return name


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

"""The flat model: variables, equations, algorithms and functions."""

import dataclasses
import math
from collections.abc import Iterator, Mapping

from .expressions import Assert, Binary, Body, Expression, WhenClause


@dataclasses.dataclass(frozen=True, slots=True)
class SourcePlace:
    """A place in a Modelica text: the file and the line."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


@dataclasses.dataclass(frozen=True, slots=True)
class FlatVariable:
    """A variable or parameter by its Modelica path. `type` is Real, Integer, Boolean, String, an enumeration, or the
    class of an external object; `variability` is constant, parameter, discrete or continuous.
    """

    name: str
    type: str
    variability: str
    causality: str = ""
    dims: tuple[int, ...] = ()
    binding: Expression | None = None
    start: Expression | None = None
    start_level: float = math.inf  # how deep in the model the modifier of the start value is; infinite in a type
    fixed: tuple[bool, ...] = ()  # one for all elements, or one for each; empty if not stated
    min: Expression | None = None
    max: Expression | None = None
    nominal: Expression | None = None
    unit: str | None = None
    select: str = "Default"
    is_flow: bool = False
    is_stream: bool = False
    is_overconstrained: bool = False
    evaluate: bool = False
    is_expandable: bool = False  # a member of an expandable connector, which exists only if something uses it
    place: SourcePlace | None = None  # of the declaration
    stated: SourcePlace | None = None  # of the modifier, or the declaration, that gives the value or start value

    @property
    def source(self) -> SourcePlace | None:
        """The place of the value, or of the declaration."""
        return self.stated or self.place


@dataclasses.dataclass(frozen=True, slots=True)
class FlatEquation:
    """An equation as a residual, or as two sides where the left one is a tuple."""

    residual: Expression
    component: str
    origin: str  # "component", "connection", "flows" or "open flow"
    place: SourcePlace | None


def equality(
    left: Expression, right: Expression, origin: str, component: str = "", place: SourcePlace | None = None
) -> FlatEquation:
    """The equation of two sides."""
    return FlatEquation(Binary("Sub", left, right), component, origin, place)


def sides(residual: Expression) -> Iterator[tuple[Expression, Expression]]:
    """The sides of an equation, in both orders; none if it is no difference."""
    match residual:
        case Binary("Sub", left, right):
            yield from ((left, right), (right, left))


@dataclasses.dataclass(frozen=True, slots=True)
class Algorithm:
    body: Body
    outputs: tuple[str, ...]
    component: str
    place: SourcePlace | None


@dataclasses.dataclass(frozen=True, slots=True)
class Formal:
    """An input, output or local of a function."""

    name: str
    type: str
    default: Expression | None
    dims: tuple[Expression, ...]


@dataclasses.dataclass(frozen=True, slots=True)
class FlatFunction:
    """A function; `external` is the name of its C function and the names of its arguments."""

    name: str
    inputs: tuple[Formal, ...]
    outputs: tuple[Formal, ...]
    locals: tuple[Formal, ...]
    body: Body
    is_constructor: bool
    external: str | None
    place: SourcePlace | None


@dataclasses.dataclass(frozen=True, slots=True)
class ExperimentAnnotation:
    """The annotation `experiment` of a model: times in s, and the relative tolerance. None for what it does not
    state.
    """

    start: float | None = None
    stop: float | None = None
    tolerance: float | None = None
    interval: float | None = None


@dataclasses.dataclass(frozen=True, slots=True)
class FlatModelica:
    """A flat Modelica model."""

    name: str
    variables: Mapping[str, FlatVariable]
    equations: tuple[FlatEquation, ...]
    initial_equations: tuple[FlatEquation, ...]
    asserts: tuple[Assert, ...]
    initial_asserts: tuple[Assert, ...]
    algorithms: tuple[Algorithm, ...]
    initial_algorithms: tuple[Algorithm, ...]
    whens: tuple[WhenClause, ...]
    functions: Mapping[str, FlatFunction]
    enumerations: Mapping[str, int]  # ordinals of the literals
    connectors: tuple[str, ...]  # those of the model itself
    selecting: tuple[Expression, ...]  # by their values, equations, components and sizes were selected
    classes: Mapping[str, str]  # names of the classes of components and records, by paths without indices
    experiment: ExperimentAnnotation
    warnings: tuple[str, ...]

"""Expressions and statements of a flat Modelica model."""

import dataclasses
from typing import TypeAlias

Value: TypeAlias = bool | int | float | str


@dataclasses.dataclass(frozen=True, slots=True)
class Const:
    """A literal."""

    value: Value


@dataclasses.dataclass(frozen=True, slots=True)
class Colon:
    """The subscript `:`."""


@dataclasses.dataclass(frozen=True, slots=True)
class Ref:
    """A reference to a variable, a record, an enumeration literal or a local name, with subscripts."""

    name: str
    subs: "tuple[Expression, ...]" = ()


@dataclasses.dataclass(frozen=True, slots=True)
class Unary:
    op: str
    arg: "Expression"


@dataclasses.dataclass(frozen=True, slots=True)
class Binary:
    op: str
    left: "Expression"
    right: "Expression"


@dataclasses.dataclass(frozen=True, slots=True)
class Builtin:
    """A call of an operator or function of the language, such as `der`, `pre`, `sin`, `size`."""

    name: str
    args: "tuple[Expression, ...]"


@dataclasses.dataclass(frozen=True, slots=True)
class FunctionCall:
    """A call of a function of the model or library, or of the constructor of a record."""

    name: str
    args: "tuple[Expression, ...]"
    is_constructor: bool = False


@dataclasses.dataclass(frozen=True, slots=True)
class If:
    branches: "tuple[tuple[Expression, Expression], ...]"
    otherwise: "Expression"


@dataclasses.dataclass(frozen=True, slots=True)
class ArrayOf:
    """An array constructor `{a, b}`."""

    elements: "tuple[Expression, ...]"


@dataclasses.dataclass(frozen=True, slots=True)
class Comprehension:
    """`{body for name in range, ...}`."""

    body: "Expression"
    indices: "tuple[tuple[str, Expression], ...]"


@dataclasses.dataclass(frozen=True, slots=True)
class RangeOf:
    start: "Expression"
    step: "Expression | None"
    stop: "Expression"


@dataclasses.dataclass(frozen=True, slots=True)
class TupleOf:
    """The left side of an equation with several results; None for one that is dropped."""

    elements: "tuple[Expression | None, ...]"


@dataclasses.dataclass(frozen=True, slots=True)
class FieldOf:
    """A field of a record, or of each record of an array."""

    base: "Expression"
    name: str


@dataclasses.dataclass(frozen=True, slots=True)
class Subscript:
    """Subscripts of an expression that is not a name."""

    base: "Expression"
    subs: "tuple[Expression, ...]"


@dataclasses.dataclass(frozen=True, slots=True)
class Text:
    """The conversion of a value to a string."""

    arg: "Expression"


Expression: TypeAlias = (
    Const
    | Colon
    | Ref
    | Unary
    | Binary
    | Builtin
    | FunctionCall
    | If
    | ArrayOf
    | Comprehension
    | RangeOf
    | TupleOf
    | FieldOf
    | Subscript
    | Text
)


@dataclasses.dataclass(frozen=True, slots=True)
class Assign:
    """`target := value`; several targets for a function with several results, None for one that is dropped."""

    targets: "tuple[Target | None, ...]"
    value: Expression


@dataclasses.dataclass(frozen=True, slots=True)
class Target:
    """The variable that a statement assigns: its name, with the subscripts of its last part."""

    name: str
    subs: tuple[Expression, ...] = ()


@dataclasses.dataclass(frozen=True, slots=True)
class IfStatement:
    blocks: "tuple[tuple[Expression, Body], ...]"
    otherwise: "Body"


@dataclasses.dataclass(frozen=True, slots=True)
class For:
    indices: tuple[tuple[str, Expression], ...]
    body: "Body"


@dataclasses.dataclass(frozen=True, slots=True)
class While:
    condition: Expression
    body: "Body"


@dataclasses.dataclass(frozen=True, slots=True)
class WhenClause:
    """`when` and `elsewhen` with their bodies: statements, or equations written as assignments."""

    blocks: "tuple[tuple[Expression, Body], ...]"


@dataclasses.dataclass(frozen=True, slots=True)
class Assert:
    """An assertion, or `terminate`, whose condition is never true."""

    condition: Expression
    message: Expression
    is_warning: bool
    name: str = dataclasses.field(default="assert", compare=False)  # with the component, file and line


@dataclasses.dataclass(frozen=True, slots=True)
class Reinit:
    state: str
    value: Expression
    index: tuple[int, ...] = ()  # of one element of an array


@dataclasses.dataclass(frozen=True, slots=True)
class Return:
    pass


@dataclasses.dataclass(frozen=True, slots=True)
class BreakStatement:
    pass


Statement: TypeAlias = Assign | IfStatement | For | While | WhenClause | Assert | Reinit | Return | BreakStatement
Body: TypeAlias = tuple[Statement, ...]

"""The syntax tree (Modelica 3.6, appendix A). Nodes are never changed after they are made.

Nodes are not frozen dataclasses, because Python restores these from the cache more slowly than it parses them.
"""

from dataclasses import dataclass, field
from typing import TypeAlias


@dataclass(slots=True, eq=False)
class Node:
    """A node of the tree; `at` is its offset in the text."""

    at: int = field(kw_only=True)


@dataclass(slots=True, eq=False)
class Literal(Node):
    """A number, truth or string."""

    value: bool | int | float | str


@dataclass(slots=True, eq=False)
class Part(Node):
    """A name in a component reference, with its subscripts."""

    name: str
    subs: "tuple[Expression, ...]"


@dataclass(slots=True, eq=False)
class Reference(Node):
    """A component reference, such as `a.b[2].c`. `is_global`: with a dot in front."""

    parts: tuple[Part, ...]
    is_global: bool

    def __str__(self) -> str:
        return "." * self.is_global + ".".join(part.name + "[...]" * bool(part.subs) for part in self.parts)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.name for part in self.parts)


@dataclass(slots=True, eq=False)
class Name(Node):
    """The name of a class, such as `Modelica.Units.SI`."""

    parts: tuple[str, ...]
    is_global: bool

    def __str__(self) -> str:
        return "." * self.is_global + ".".join(self.parts)


@dataclass(slots=True, eq=False)
class Call(Node):
    """A call of a function or operator. `function` is a name such as `der` or a component reference."""

    function: Reference
    args: "tuple[Expression, ...]"
    named: "tuple[tuple[str, Expression], ...]"


@dataclass(slots=True, eq=False)
class PartialCall(Node):
    """A function as an argument: `function f(a = 1)`."""

    function: Reference
    named: "tuple[tuple[str, Expression], ...]"


@dataclass(slots=True, eq=False)
class Iterator(Node):
    """`name in range`; the range is None if it follows from the subscripts that use the name."""

    name: str
    range: "Expression | None"


@dataclass(slots=True, eq=False)
class Reduction(Node):
    """`function(body for iterators)`, or an array `{body for iterators}`, with the function "array"."""

    function: Reference
    body: "Expression"
    iterators: tuple[Iterator, ...]


@dataclass(slots=True, eq=False)
class Unary(Node):
    """`op` is "-", "+", "not", ".-" or ".+"."""

    op: str
    arg: "Expression"


@dataclass(slots=True, eq=False)
class Binary(Node):
    op: str
    left: "Expression"
    right: "Expression"


@dataclass(slots=True, eq=False)
class IfExpression(Node):
    branches: "tuple[tuple[Expression, Expression], ...]"
    otherwise: "Expression"


@dataclass(slots=True, eq=False)
class Array(Node):
    """`{a, b}`."""

    elements: "tuple[Expression, ...]"


@dataclass(slots=True, eq=False)
class Matrix(Node):
    """`[a, b; c, d]`, by rows."""

    rows: "tuple[tuple[Expression, ...], ...]"


@dataclass(slots=True, eq=False)
class Range(Node):
    start: "Expression"
    step: "Expression | None"
    stop: "Expression"


@dataclass(slots=True, eq=False)
class Tuple(Node):
    """`(a, , b)`: results of a function. None for one that is dropped."""

    elements: "tuple[Expression | None, ...]"


@dataclass(slots=True, eq=False)
class Subscripted(Node):
    """Subscripts of an expression in parentheses."""

    base: "Expression"
    subs: "tuple[Expression, ...]"


@dataclass(slots=True, eq=False)
class End(Node):
    """`end` in a subscript."""


@dataclass(slots=True, eq=False)
class Whole(Node):
    """The subscript `:`, or the size `:`."""


@dataclass(slots=True, eq=False)
class NoValue(Node):
    """`break` as the value of a modifier, which removes the value of the declaration (Modelica 3.7, section 7.2.7)."""


Expression: TypeAlias = (
    Literal
    | Reference
    | Call
    | PartialCall
    | Reduction
    | Unary
    | Binary
    | IfExpression
    | Array
    | Matrix
    | Range
    | Tuple
    | Subscripted
    | End
    | Whole
    | NoValue
)


@dataclass(slots=True, eq=False)
class Equality(Node):
    """An equation `left = right`."""

    left: Expression
    right: Expression


@dataclass(slots=True, eq=False)
class Assignment(Node):
    """`left := right`; `left` is a component reference, or a tuple for several results."""

    left: Reference | Tuple
    right: Expression


@dataclass(slots=True, eq=False)
class CallEquation(Node):
    """A call as an equation or statement, such as `assert(...)`."""

    call: Call


@dataclass(slots=True, eq=False)
class Connect(Node):
    left: Expression
    right: Expression


@dataclass(slots=True, eq=False)
class IfClause(Node):
    """An if-equation or if-statement."""

    branches: "tuple[tuple[Expression, Clauses], ...]"
    otherwise: "Clauses"


@dataclass(slots=True, eq=False)
class ForClause(Node):
    iterators: tuple[Iterator, ...]
    body: "Clauses"


@dataclass(slots=True, eq=False)
class WhileClause(Node):
    condition: Expression
    body: "Clauses"


@dataclass(slots=True, eq=False)
class WhenClause(Node):
    branches: "tuple[tuple[Expression, Clauses], ...]"


@dataclass(slots=True, eq=False)
class Return(Node):
    """`return`."""


@dataclass(slots=True, eq=False)
class Break(Node):
    """`break`."""


Clause: TypeAlias = (
    Equality | Assignment | CallEquation | Connect | IfClause | ForClause | WhileClause | WhenClause | Return | Break
)
Clauses: TypeAlias = tuple[Clause, ...]


@dataclass(slots=True, eq=False)
class Section(Node):
    """An equation or algorithm section."""

    is_algorithm: bool
    is_initial: bool
    clauses: Clauses


@dataclass(slots=True, eq=False)
class Modification(Node):
    """`(arguments) = value`, where each of both may be missing."""

    arguments: "tuple[Argument, ...]"
    value: "Expression | None"

    def named(self, name: str) -> "list[ElementModification]":
        """The modifications of an element."""
        return [one for one in self.arguments if isinstance(one, ElementModification) and one.name == (name,)]


@dataclass(slots=True, eq=False)
class ElementModification(Node):
    """`each final name(...) = value`."""

    name: tuple[str, ...]
    is_each: bool
    is_final: bool
    modification: Modification


@dataclass(slots=True, eq=False)
class ElementReplacement(Node):
    """`redeclare` or `replaceable`, which means the same, of an element in a modification."""

    is_each: bool
    is_final: bool
    element: "Component | Class"


@dataclass(slots=True, eq=False)
class BreakModification(Node):
    """`break name` or `break connect(a, b)` in an extends-clause."""

    name: str
    connect: Connect | None


Argument: TypeAlias = ElementModification | ElementReplacement | BreakModification


@dataclass(slots=True, eq=False)
class Constraint(Node):
    """`constrainedby` class and modification."""

    type: Name
    modification: Modification | None


@dataclass(slots=True, eq=False)
class Import(Node):
    """An import clause. `alias` is the local name. Without it, `names` are imported: all of a package, if None."""

    name: Name
    alias: str | None
    names: "tuple[str, ...] | None"


@dataclass(slots=True, eq=False)
class Extends(Node):
    type: Name
    modification: Modification | None
    annotation: Modification | None
    is_protected: bool


@dataclass(slots=True, eq=False)
class Component(Node):
    """A component declaration. `dims` are those of the component before those of its type, as in `Real[3] x[2]`."""

    name: str
    type: Name
    variability: str  # "", "constant", "parameter" or "discrete"
    causality: str  # "", "input" or "output"
    connection: str  # "", "flow" or "stream"
    dims: tuple[Expression, ...]
    modification: Modification | None
    condition: Expression | None
    is_final: bool
    is_redeclare: bool
    is_inner: bool
    is_outer: bool
    is_replaceable: bool
    is_protected: bool
    constraint: Constraint | None
    annotation: Modification | None


@dataclass(slots=True, eq=False)
class External(Node):
    """The external function: language, name, the variable that gets its result, and arguments."""

    language: str
    name: str
    result: Reference | None
    args: tuple[Expression, ...]


@dataclass(slots=True, eq=False)
class Long:
    """`class A ... end A`. `extends` is the modification of `class extends A(...)`; the class then extends itself."""

    elements: "tuple[Element, ...]"
    sections: tuple[Section, ...]
    external: External | None
    extends: Modification | None
    is_class_extends: bool


@dataclass(slots=True, eq=False)
class Short:
    """`class A = prefix B[dims](...)`."""

    causality: str
    type: Name
    dims: tuple[Expression, ...]
    modification: Modification | None


@dataclass(slots=True, eq=False)
class Enumeration:
    """The names of literals; None for `enumeration(:)`."""

    literals: tuple[str, ...] | None


@dataclass(slots=True, eq=False)
class Derivative:
    """`function f = der(g, x)`."""

    function: Name
    variables: tuple[str, ...]


Specialised: TypeAlias = str  # "class", "model", "function", "expandable connector", "operator record" and so on


@dataclass(slots=True, eq=False)
class Class(Node):
    """A class definition."""

    name: str
    kind: Specialised
    body: Long | Short | Enumeration | Derivative
    is_partial: bool
    is_encapsulated: bool
    is_final: bool
    is_redeclare: bool
    is_inner: bool
    is_outer: bool
    is_replaceable: bool
    is_protected: bool
    is_impure: bool
    constraint: Constraint | None
    annotation: Modification | None


Element: TypeAlias = Import | Extends | Component | Class


@dataclass(slots=True, eq=False)
class File:
    """A stored definition: the name after `within`, "" for the top, None without such a clause; and classes."""

    within: str | None
    classes: tuple[Class, ...]

"""Equations (Modelica 3.6, chapter 8)."""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, SourcePlace, equality
from .._syntax.visits import nodes, targets
from . import tree as t
from .algorithms import Statements, assertion, check_discrete, when_condition
from .calls import as_type
from .expressions import Expressions
from .typed import (
    REAL,
    Dims,
    Type,
    Typed,
    accepts,
    element,
    indices,
    joined_dims,
    same_dims,
    written_dims,
)

CONNECTION_OPERATORS = ("branch", "root", "potentialRoot", "uniqueRoot", "uniqueRootIndices")


@dataclasses.dataclass
class Found:
    """The equations of a section, of the whole model, or of a branch."""

    equations: list[FlatEquation] = dataclasses.field(default_factory=list)
    asserts: list[e.Assert] = dataclasses.field(default_factory=list)
    whens: list[e.WhenClause] = dataclasses.field(default_factory=list)
    sizes: list[Dims] = dataclasses.field(default_factory=list)  # of the equations
    calls: list[FlatEquation] = dataclasses.field(default_factory=list)  # without results, which determine nothing
    reset: set[str] = dataclasses.field(default_factory=set)  # the elements of states with a `reinit`

    def add(self, equation: FlatEquation, dims: Dims) -> None:
        self.equations.append(equation)
        self.sizes.append(dims)

    def scalars(self) -> "Found":
        """The same equations, each element of an array by itself."""
        found = Found([], self.asserts, self.whens)
        for equation, dims in zip(self.equations, self.sizes, strict=True):
            if not dims or None in dims:
                found.add(equation, dims)
                continue
            for index in indices(dims):
                residual = _element_of(equation.residual, [e.Const(i) for i in index])
                found.add(dataclasses.replace(equation, residual=residual), ())
        return found


@dataclasses.dataclass
class Equations:
    """Makes the equations of a class instance, except connections (`connections.py`)."""

    here: Expressions
    found: Found
    is_initial: bool = False

    def all(self, clauses: Sequence[t.Clause]) -> None:
        for clause in clauses:
            self.one(clause)

    def one(self, x: t.Clause) -> None:
        """Adds the equations of a clause. Raises `TextError`."""
        match x:
            case t.Equality():
                self._equality(x)
            case t.ForClause():
                for within in self.here.unrolled(x.iterators, x.body):
                    dataclasses.replace(self, here=within).all(x.body)
            case t.IfClause():
                self._if(x)
            case t.WhenClause():
                self._when(x)
            case t.CallEquation():
                self._call(x.call)
            case t.Connect():
                return
            case _:
                raise self.here.error(x.at, "a statement is not allowed in an equation section.")

    def _place(self, at: int) -> SourcePlace:
        return self.here.scope.source.place(at)

    def _add(self, left: e.Expression, right: e.Expression, at: int, dims: Dims = ()) -> None:
        self.found.add(equality(left, right, "component", self.here.scope.path, self._place(at)), dims)

    def _equality(self, x: t.Equality) -> None:
        here = self.here
        left, right = here.typed(x.left), here.typed(x.right)
        if isinstance(x.left, t.Tuple):
            self._several(x, left, right)
            return
        left, right = here.single(x.left), here.single(x.right)
        if (changed := as_type(here, left.type, right)) is not None:
            right = changed
        elif (changed := as_type(here, right.type, left)) is not None:
            left = changed
        else:
            raise here.error(x.at, f"the sides of the equation have different types: {left.type} and {right.type}.")
        if not same_dims(left.dims, right.dims):
            raise here.error(
                x.at,
                f"the sides of the equation have different sizes: {written_dims(left.dims)} and "
                f"{written_dims(right.dims)}.",
            )
        self.check_type(x.at, left.type)
        for side, one, other in ((x.left, left, right), (x.right, right, left)):
            # An equation of Reals may determine another variable than the discrete one.
            if isinstance(side, t.Reference) and not self.is_initial and one.type == other.type != REAL:
                check_discrete(here, side, one, other, is_when=False)
        if left.type.name == "record":
            self._records(left, right, x.at)
        elif 0 not in left.dims:
            self._add(left.x, right.x, x.at, joined_dims(left.dims, right.dims))

    def check_type(self, at: int, kind: Type) -> None:
        if not kind.is_plain and kind.name not in ("record", "Clock", "any"):
            raise self.here.error(at, f"an equation cannot have sides of type {kind}.")

    def _records(self, left: Typed, right: Typed, at: int) -> None:
        """The equations of the fields, if both sides are variables or written out."""
        if not (_is_written(left.x) and _is_written(right.x)) or None in left.dims:
            self._add(left.x, right.x, at)
            return
        for a, b in zip(self._elements(left), self._elements(right), strict=True):
            for one, other in zip(self._fields(a), self._fields(b), strict=True):
                if one.type.name == "record":
                    self._records(one, other, at)
                elif 0 not in one.dims:
                    self._add(one.x, other.x, at, one.dims)

    def _elements(self, x: Typed) -> Iterator[Typed]:
        if not x.dims:
            yield x
        elif isinstance(x.x, e.ArrayOf):
            for item in x.x.elements:
                yield from self._elements(x._replace(x=item, dims=x.dims[1:]))

    def _fields(self, x: Typed) -> list[Typed]:
        names = sorted(one.name for one in x.type.instance.components()) if x.type.instance else []
        return [found for name in names if (found := self.here.context.field(x, name)) is not None]

    def _several(self, x: t.Equality, left: Typed, right: Typed) -> None:
        here = self.here
        for one in x.left.elements if isinstance(x.left, t.Tuple) else ():
            if one is not None and not isinstance(one, t.Reference):
                raise here.error(one.at, "the left side of an equation with several results must have variables.")
        if not isinstance(x.right, t.Call) or len(left.results) > max(1, len(right.results)):
            raise here.error(x.at, f"the left side has {len(left.results)} variables for {len(right.results)} results.")
        for one, other in zip(left.results, right.results, strict=False):
            if not accepts(one.type, other.type) or (one.type.name != "any" and not same_dims(one.dims, other.dims)):
                raise here.error(x.at, f"a result of type {other.type} is assigned to a variable of type {one.type}.")
        self._add(left.x, right.x, x.at)

    def _if(self, x: t.IfClause) -> None:
        conditions, chosen = self.here.choice(x)
        if chosen is not None:
            self.all(chosen)
            return
        bodies = [self._branch(body) for _, body in x.branches]
        otherwise = self._branch(x.otherwise)
        if len({len(body.equations) for body in (*bodies, otherwise)}) > 1:
            bodies, otherwise = [body.scalars() for body in bodies], otherwise.scalars()
        self._asserts(conditions, [*bodies, otherwise])
        if any(body.whens for body in (*bodies, otherwise)):
            raise self.here.error(x.at, "`when` is not allowed in an if-equation whose condition varies.")
        counts = {len(body.equations) for body in (*bodies, otherwise)}
        if counts == {0}:
            return
        if len(counts) > 1:
            raise self.here.error(
                x.at, f"the branches of the if-equation have different numbers of equations: {sorted(counts)}."
            )
        for i, last in enumerate(otherwise.equations):
            residuals = [body.equations[i].residual for body in bodies]
            residual = _chosen([c.x for c in conditions], residuals, last.residual)
            if residual is None:
                raise self.here.error(x.at, "the branches of the if-equation give results to different variables.")
            equation = FlatEquation(residual, self.here.scope.path, "component", self._place(x.at))
            self.found.add(equation, otherwise.sizes[i])

    def _branch(self, clauses: Sequence[t.Clause]) -> Found:
        """The equations of a branch, without calls that determine nothing: their assertions hold only in the branch."""
        found = Found()
        here = dataclasses.replace(self.here, in_branch=True)
        dataclasses.replace(self, here=here, found=found).all(clauses)
        return found

    def _asserts(self, conditions: Sequence[Typed], bodies: Sequence[Found]) -> None:
        """Assertions in branches, which hold only where their branch is chosen."""
        before: list[e.Expression] = []
        for i, body in enumerate(bodies):
            excused = [*before, e.Unary("Not", conditions[i].x)] if i < len(conditions) else before
            for one in body.asserts:
                condition = one.condition
                for excuse in excused:
                    condition = e.Binary("Or", excuse, condition)
                self.found.asserts.append(dataclasses.replace(one, condition=condition))
            if i < len(conditions):
                before.append(conditions[i].x)

    def _call(self, call: t.Call) -> None:
        name = call.function.names
        if name == ("assert",):
            self.found.asserts.append(assertion(self.here, call))
            return
        if name[0] == "Connections" and name[-1] in CONNECTION_OPERATORS:
            return
        if name == ("terminate",):  # at the start
            body = (Statements(self.here).call(call),)
            self.found.whens.append(e.WhenClause(((e.Builtin("Initial", ()), body),)))
            return
        if name == ("reinit",):
            raise self.here.error(call.at, "`reinit` is allowed in when-clauses only.")
        found = self.here.typed(call)
        if not isinstance(found.x, e.FunctionCall):
            raise self.here.error(call.at, f"{call.function} is no equation.")
        own = equality(e.TupleOf(()), found.x, "component", self.here.scope.path, self._place(call.at))
        self.found.calls.append(own)

    def _when(self, x: t.WhenClause) -> None:
        blocks: list[tuple[e.Expression, e.Body]] = []
        for condition, body in x.branches:
            inner = _WhenBody(self.here.within_when())
            statements = inner.body(body)
            kinds = ("Boolean", "Clock") if len(x.branches) == 1 else ("Boolean",)  # clocks: section 16.6
            blocks.append((when_condition(self.here, condition, kinds), statements))
        same_targets(self.here, x.at, [body for _, body in blocks], "when")
        own = {one for _, body in blocks for one in self._reset(x.at, body)}
        if again := sorted(own & self.found.reset):
            raise self.here.error(
                x.at, f"{again[0]} has a `reinit` in another when-clause, too. Remedy: join them by `elsewhen`."
            )
        self.found.reset |= own
        self.found.whens.append(e.WhenClause(tuple(blocks)))

    def _reset(self, at: int, body: e.Body) -> Iterator[str]:
        """The elements of states that a body sets, each in one equation only (section 8.3.6)."""
        for one in nodes(body):
            if isinstance(one, e.Reinit):
                yield from _elements(self.here, at, e.Target(one.state, tuple(map(e.Const, one.index))))


def _chosen(
    conditions: Sequence[e.Expression], residuals: Sequence[e.Expression], otherwise: e.Expression
) -> e.Expression | None:
    """The residual of an if-equation; None if functions give several results to different variables."""
    match otherwise:
        case e.Binary("Sub", e.TupleOf() as left, last):
            values = [x.right for x in residuals if isinstance(x, e.Binary) and x.left == left]
            if len(values) < len(residuals):
                return None
            return e.Binary("Sub", left, e.If(tuple(zip(conditions, values, strict=True)), last))
    return e.If(tuple(zip(conditions, residuals, strict=True)), otherwise)


class _WhenBody(Statements):
    """The equations of a when-clause, as statements."""

    def statement(self, x: t.Clause) -> tuple[e.Statement, ...]:
        here = self.here
        match x:
            case t.Equality(t.Reference() | t.Tuple() as left, right):
                return super().statement(t.Assignment(left, right, at=x.at))
            case t.Equality():
                raise here.error(x.at, "the left side of an equation in `when` must be a variable.")
            case t.CallEquation(call):
                return self.reinit(call) if call.function.names == ("reinit",) else (self.call(call),)
            case t.IfClause():
                return self._choice(x)
            case t.ForClause():
                loops = here.unrolled(x.iterators, x.body)
                return tuple(item for within in loops for item in _WhenBody(within).body(x.body))
            case t.WhenClause():
                raise here.error(x.at, "`when` is not allowed in `when`.")
            case t.Connect():
                raise here.error(x.at, "`connect` is not allowed in `when`.")
        raise here.error(x.at, "a statement is not allowed in an equation section.")

    def _choice(self, x: t.IfClause) -> tuple[e.Statement, ...]:
        conditions, chosen = self.here.choice(x)
        if chosen is not None:
            return self.body(chosen)
        blocks = tuple((c.x, self.body(body)) for c, (_, body) in zip(conditions, x.branches, strict=True))
        otherwise = self.body(x.otherwise)
        same_targets(self.here, x.at, [*(body for _, body in blocks), otherwise], "if")
        return (e.IfStatement(blocks, otherwise),)


def same_targets(here: Expressions, at: int, bodies: Sequence[e.Body], clause: str) -> None:
    """Raises `TextError` for branches that give values to different variables (section 8.3.5.2)."""
    first, *rest = [{name for one in targets(body) for name in _elements(here, at, one)} for body in bodies]
    for other in rest:
        if first != other:
            name = sorted(first ^ other)[0]
            raise here.error(
                at, f"only one branch of `{clause}` gives {name} a value; all must have the same variables."
            )


def _elements(here: Expressions, at: int, target: e.Target) -> Iterator[str]:
    """The elements of a variable that a statement assigns."""
    component = here.context.find(target.name)
    sizes = [] if component is None else [n or 0 for n in here.context.sizes(component)]
    chosen = [one for one in here.members(target.subs, sizes) if one is not None]
    if len(chosen) < len(sizes):
        raise here.error(at, f"a subscript of {target.name} must be known here.")
    for index in itertools.product(*chosen):
        yield f"{target.name}{list(index) or ''}"


def _element_of(residual: e.Expression, index: Sequence[e.Expression]) -> e.Expression:
    """The equation of one element of an array."""
    match residual:
        case e.Binary("Sub", left, right):
            return e.Binary("Sub", element(left, index), element(right, index))
        case e.If(branches, otherwise):
            inner = tuple((condition, _element_of(branch, index)) for condition, branch in branches)
            return e.If(inner, _element_of(otherwise, index))
    return element(residual, index)


def _is_written(x: e.Expression) -> bool:
    """Whether the fields of a record are names or written out."""
    match x:
        case e.Ref(_, ()):
            return True
        case e.FunctionCall(_, _, True):
            return True
        case e.ArrayOf(elements):
            return all(map(_is_written, elements))
    return False


def has_connections(x: t.Clause) -> bool:
    """Whether a clause is one of the connections of a model, or contains some."""
    return any(
        isinstance(one, t.Connect | t.WhenClause)
        or (isinstance(one, t.CallEquation) and one.call.function.names[0] == "Connections")
        for one in nodes(x)
    )

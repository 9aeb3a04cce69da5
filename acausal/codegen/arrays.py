"""The C form of conditionals, of loops, and of primitives that move, combine or reduce the elements of arrays."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from .._jax_private import JaxprEqn, scan_counts
from .._reduce.jaxpr import bind, shape_of
from .expressions import ELEMENTWISE, PRODUCT, SUM, Expression, call, choice, kind_of, number
from .values import CValue, Index, stored

if TYPE_CHECKING:
    from .writer import Writer


Rule = Callable[["Writer", JaxprEqn, list[CValue]], Sequence[CValue]]


def _numbered(shape: tuple[int, ...]) -> np.ndarray:
    """The positions of the elements of an array."""
    return np.arange(math.prod(shape)).reshape(shape)


def _moves(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
    """An operation that moves the elements of one array, applied to their positions."""
    with jax.ensure_compile_time_eval():
        moved = [np.asarray(places) for places in bind(eqn, [jnp.asarray(_numbered(args[0].shape))])]
    is_repeated = sum(places.size for places in moved) > args[0].size
    source = writer.kept(args[0]) if is_repeated or len(moved) > 1 else args[0]
    return [source.moved(places) for places in moved]


def _parts(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
    """An array put together from others: their elements, and the positions at which they stand."""
    shape, kind = shape_of(eqn.outvars[0]), kind_of(eqn.outvars[0])
    target = writer.declare(shape, kind)
    owner = [np.full(arg.shape, i) for i, arg in enumerate(args)]
    with jax.ensure_compile_time_eval():
        which = np.asarray(bind(eqn, [jnp.asarray(mask) for mask in owner])[0])
    for i, arg in enumerate(args):
        writer.assign(target, arg, np.flatnonzero(which == i))
    return [target]


def _padded(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
    value, filler = args
    places = np.asarray(jax.lax.pad(jnp.asarray(_numbered(value.shape)), -1, eqn.params["padding_config"]))
    target = writer.declare(places.shape, value.kind)
    empty, own = np.flatnonzero(places == -1), np.flatnonzero(places != -1)
    writer.assign(target, filler.moved(np.zeros(len(empty), int)), empty)
    writer.assign(target, value.moved(places.ravel()[own]), own)
    return [target]


def _rows(value: CValue, axes: Sequence[int]) -> np.ndarray:
    """The positions of the elements that are combined, a row for each result."""
    kept = [axis for axis in range(len(value.shape)) if axis not in axes]
    count = math.prod(value.shape[axis] for axis in kept)
    return np.transpose(_numbered(value.shape), (*kept, *axes)).reshape(count, -1)


def _reduction(rule: str, start: float) -> Rule:
    """A reduction by a rule for two operands, from its neutral element."""

    def reduce(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
        (value,) = args
        kind, params = kind_of(eqn.outvars[0]), eqn.params
        target, rows = writer.declare(shape_of(eqn.outvars[0]), kind), _rows(value, params["axes"])
        with writer.loops(len(rows)) as out:
            total = target.at(out)
            writer.line(f"{total.text} = {number(start, kind).text};")
            with writer.loops(1, rows.shape[1]) as own:
                own = Index(rows, (*out.variables, own.variables[1]), writer.tables)
                writer.line(f"{total.text} = {ELEMENTWISE[rule](kind, params, total, value.at(own)).text};")
        return [target]

    return reduce


def _arg_reduction(relation: str) -> Rule:
    """The place of the first largest or smallest element, or of the first NaN. `relation` holds between an element and
    the best one before it if that remains.
    """

    def reduce(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
        value = writer.kept(args[0])
        kind = kind_of(eqn.outvars[0])
        target, rows = writer.declare(shape_of(eqn.outvars[0]), kind), _rows(value, eqn.params["axes"])
        best = writer.declare((), value.kind, "best").at(Index(np.array(0), (), writer.tables)).text
        with writer.loops(len(rows)) as out:
            first = Index(rows[:, 0], out.variables, writer.tables)
            writer.line(f"{target.at(out).text} = 0;")
            writer.line(f"{best} = {value.at(first).text};")
            with writer.loops(1, rows.shape[1]) as inner:
                own = value.at(Index(rows, (*out.variables, inner.variables[1]), writer.tables)).text
                with writer.block(f"if (!({own} {relation} {best}) && !isnan({best}))"):
                    writer.line(f"{best} = {own};")
                    writer.line(f"{target.at(out).text} = {inner.variables[1] or '0'};")
        return [target]

    return reduce


def _cumulative(rule: str) -> Rule:
    def run(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
        (value,) = args
        rows = _rows(value, [eqn.params["axis"]])
        rows = rows[:, ::-1] if eqn.params["reverse"] else rows
        target = writer.declare(value.shape, value.kind)
        with writer.loops(len(rows)) as out:
            first = Index(rows[:, 0], out.variables, writer.tables)
            writer.line(f"{target.at(first).text} = {value.at(first).text};")
            if rows.shape[1] > 1:
                with writer.loops(1, rows.shape[1] - 1) as inner:
                    loops = (*out.variables, inner.variables[1])
                    now, before = (Index(part, loops, writer.tables) for part in (rows[:, 1:], rows[:, :-1]))
                    result = ELEMENTWISE[rule](value.kind, eqn.params, target.at(before), value.at(now))
                    writer.line(f"{target.at(now).text} = {result.text};")
        return [target]

    return run


def _dot(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
    (sum_a, sum_b), (batch_a, batch_b) = eqn.params["dimension_numbers"]
    a, b = (writer.kept(arg) for arg in args)
    places_a, places_b = (
        _factor(value, batch, summed) for value, batch, summed in ((a, batch_a, sum_a), (b, batch_b, sum_b))
    )
    n_batch, n_a, n_sum = places_a.shape
    whole = (n_batch, n_a, places_b.shape[1], n_sum)
    every_a = np.broadcast_to(places_a[:, :, None], whole).reshape(-1, n_sum)
    every_b = np.broadcast_to(places_b[:, None], whole).reshape(-1, n_sum)
    target = writer.declare(shape_of(eqn.outvars[0]), a.kind)
    with writer.loops(n_batch, n_a, places_b.shape[1]) as out:
        total = target.at(out).text
        writer.line(f"{total} = {number(0, a.kind).text};")
        with writer.loops(1, n_sum) as inner:
            loops = (*out.variables, inner.variables[1])
            own_a, own_b = (Index(x.reshape(whole), loops, writer.tables) for x in (every_a, every_b))
            writer.line(f"{total} += {a.at(own_a).inside(PRODUCT)} * {b.at(own_b).inside(PRODUCT + 1)};")
    return [target]


def _factor(value: CValue, batch: Sequence[int], summed: Sequence[int]) -> np.ndarray:
    """The positions of a factor's elements, with the axes [batch, free, summed]."""
    free = [axis for axis in range(len(value.shape)) if axis not in (*batch, *summed)]
    shape = [math.prod(value.shape[axis] for axis in axes) for axes in (batch, free, summed)]
    return np.transpose(_numbered(value.shape), (*batch, *free, *summed)).reshape(shape)


def _sum_of(terms: Sequence[Expression]) -> Expression:
    return Expression(" + ".join(term.inside(SUM) for term in terms), SUM if len(terms) > 1 else terms[0].level)


def _at_start(source: CValue, starts: Sequence[Expression], most: Sequence[int], offset: Expression) -> str:
    """The position in an array of an element at an offset from an index that is limited to its range."""
    terms = [offset] if offset.text != "0" else []
    for axis, (start, limit) in enumerate(zip(starts, most, strict=True)):
        step = math.prod(source.shape[axis + 1 :])
        limited = call("within", start, number(limit, "i"))
        if limit:
            terms.append(limited if step == 1 else Expression(f"{step} * {limited.text}", PRODUCT))
    return _sum_of(terms).text if terms else "0"


def _dynamic_slice(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
    source, sizes = args[0], eqn.params["slice_sizes"]
    name = writer.array(source)
    starts = [writer.kept(arg) for arg in args[1:]]
    window = _numbered(source.shape)[tuple(slice(0, size) for size in sizes)]
    most = [n - size for n, size in zip(source.shape, sizes, strict=True)]

    def at(index: Index) -> Expression:
        scalars = [start.at(Index(np.array(0), (), writer.tables)) for start in starts]
        place = _at_start(source, scalars, most, index.through(window).expression())
        return Expression(f"{name}[{place}]")

    return [CValue(tuple(sizes), source.kind, at, 2)]


def _gather(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> list[CValue]:
    """Windows of an array at indices that are computed."""
    numbers, sizes, mode = (eqn.params[key] for key in ("dimension_numbers", "slice_sizes", "mode"))
    source, starts = args[0], writer.kept(args[1])
    name = writer.array(source)
    shape, axes = shape_of(eqn.outvars[0]), numbers.start_index_map
    batch = [axis for axis in range(len(shape)) if axis not in numbers.offset_dims]
    grid = np.indices(shape).reshape(len(shape), -1)
    dropped = (*numbers.collapsed_slice_dims, *getattr(numbers, "operand_batching_dims", ()))
    window_axes = [axis for axis in range(len(source.shape)) if axis not in dropped]
    steps = [math.prod(source.shape[axis + 1 :]) for axis in range(len(source.shape))]
    fixed = sum((grid[o] * steps[axis] for o, axis in zip(numbers.offset_dims, window_axes, strict=True)), start=0)
    for own, of_start in zip(
        getattr(numbers, "operand_batching_dims", ()), getattr(numbers, "start_indices_batching_dims", ()), strict=True
    ):
        fixed = fixed + grid[batch[of_start]] * steps[own]
    fixed = np.broadcast_to(fixed, grid.shape[1:])
    row = np.ravel_multi_index([grid[axis] for axis in batch], [shape[axis] for axis in batch]) if batch else 0 * fixed
    most = [source.shape[axis] - sizes[axis] for axis in axes]

    def at(index: Index) -> Expression:
        own = [starts.at(index.through(np.asarray(row * len(axes) + k))) for k in range(len(axes))]
        whole = [number(0, "i")] * len(steps)
        limits = [0] * len(steps)
        for axis, start, limit in zip(axes, own, most, strict=True):
            whole[axis], limits[axis] = start, limit
        place = _at_start(source, whole, limits, index.through(fixed).expression())
        found = Expression(f"{name}[{place}]")
        if "FILL" not in str(mode):
            return found
        inside = [f"{x.inside(SUM)} >= 0 && {x.inside(SUM)} <= {limit}" for x, limit in zip(own, most, strict=True)]
        return choice(Expression(" && ".join(inside), 1), found, _filler(eqn, source.kind))

    return [CValue(shape, source.kind, at, 2)]


def _filler(eqn: JaxprEqn, kind: str) -> Expression:
    given: Any = eqn.params.get("fill_value")
    return number(float("nan") if kind == "f" and given is None else given or 0, kind)


ARRAYS: dict[str, Rule] = {
    **dict.fromkeys("slice reshape squeeze expand_dims broadcast_in_dim transpose rev split".split(), _moves),
    **dict.fromkeys(("concatenate", "stack"), _parts),
    "pad": _padded,
    "reduce_sum": _reduction("add", 0.0),
    "reduce_prod": _reduction("mul", 1.0),
    "reduce_max": _reduction("max", -math.inf),
    "reduce_min": _reduction("min", math.inf),
    "reduce_and": _reduction("and", 1.0),
    "reduce_or": _reduction("or", 0.0),
    "argmax": _arg_reduction("<="),
    "argmin": _arg_reduction(">="),
    "cumsum": _cumulative("add"),
    "cumprod": _cumulative("mul"),
    "cummax": _cumulative("max"),
    "cummin": _cumulative("min"),
    "dot_general": _dot,
    "dynamic_slice": _dynamic_slice,
    "gather": _gather,
}


def _declared(writer: "Writer", eqn: JaxprEqn) -> list[CValue]:
    """Variables for the results of an equation."""
    return [writer.declare(shape_of(var), kind_of(var)) for var in eqn.outvars]


def _set(writer: "Writer", targets: Sequence[CValue], values: Sequence[CValue]) -> None:
    """Assign all values at once: those that read a target are computed before it changes."""
    copies = [_copied(writer, value) for value in values]
    for target, value in zip(targets, copies, strict=True):
        writer.assign(target, value)


def _copied(writer: "Writer", value: CValue) -> CValue:
    if value.known is not None:
        return value
    copy = writer.declare(value.shape, value.kind)
    writer.assign(copy, value)
    return copy


def _kept(writer: "Writer", values: Sequence[CValue]) -> list[CValue]:
    return [writer.kept(value) for value in values]


def _text(writer: "Writer", value: CValue) -> str:
    """The text of a scalar."""
    return value.at(Index(np.array(0), (), writer.tables)).text


def _branches(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
    which, *operands = _kept(writer, args)
    branches = eqn.params["branches"]
    targets = _declared(writer, eqn)
    for i, branch in enumerate(branches):
        is_last = i == len(branches) - 1
        test = f"({_text(writer, which)} {'<=' if i == 0 else '=='} {i})"
        head = f"if {test}" if i == 0 else "else" if is_last else f"else if {test}"
        with writer.block(head):
            for target, value in zip(targets, writer.run(branch, operands), strict=True):
                writer.assign(target, value)
    return targets


def _while(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
    n, m = eqn.params["cond_nconsts"], eqn.params["body_nconsts"]
    of_test, of_body = _kept(writer, args[:n]), _kept(writer, args[n : n + m])
    carry = _declared(writer, eqn)
    _set(writer, carry, args[n + m :])
    with writer.block("for (;;)"):
        (goes_on,) = writer.run(eqn.params["cond_jaxpr"], [*of_test, *carry])
        goes_on = writer.kept(goes_on)
        with writer.block(f"if (!{_text(writer, goes_on)})"):
            writer.line("break;")
        _set(writer, carry, writer.run(eqn.params["body_jaxpr"], [*of_body, *carry]))
    return carry


def _scan(writer: "Writer", eqn: JaxprEqn, args: list[CValue]) -> Sequence[CValue]:
    n_constants, n_carry = scan_counts(eqn)
    length = eqn.params["length"]
    constants, carried = _kept(writer, args[:n_constants]), args[n_constants:][:n_carry]
    rows = [(writer.array(value), value) for value in args[n_constants + n_carry :]]
    results = _declared(writer, eqn)
    carry, stacked = results[:n_carry], results[n_carry:]
    _set(writer, carry, carried)
    count = writer.names.new("k")
    with writer.block(f"for (int {count} = 0; {count} < {length}; {count}++)"):
        place = count
        if eqn.params["reverse"] and (rows or stacked):
            place = writer.names.new("row")
            writer.line(f"const int {place} = {length - 1} - {count};")
        own = [_row(name, value, place) for name, value in rows]
        values = writer.run(eqn.params["jaxpr"], [*constants, *carry, *own])
        for target, value in zip(stacked, values[n_carry:], strict=True):
            _set(writer, [target if target.size == 1 else _row(target.name, target, place)], [value])
        _set(writer, carry, values[:n_carry])
    return results


def _row(name: str, value: CValue, place: str) -> CValue:
    """One row of an array."""
    shape = value.shape[1:]
    size = int(np.prod(shape))
    return stored(name, shape, value.kind, place if size == 1 else f"{size} * {place}")


CONTROL: dict[str, Callable[["Writer", JaxprEqn, list[CValue]], Sequence[CValue]]] = {
    "cond": _branches,
    "while": _while,
    "scan": _scan,
}

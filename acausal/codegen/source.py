"""The C functions that evaluate a model: its start, rates, all values, outputs, and directional derivatives."""

import dataclasses
from collections.abc import Sequence

import jax
import numpy as np
from jax import Array

from .._evaluate.groups import Group
from .._jax_private import ClosedJaxpr, jaxpr_as_fun
from .._reduce.jaxpr import slice_outputs, structs
from .calls import Call, Solve, fill, operand
from .functions import CFunction, Direct, Implicit, Source, function_of
from .layout import Places
from .model import CModel
from .values import Index
from .write import array, function
from .writer import Writer

LONG = 20  # number of statements from which a test whether a function is needed pays off


@dataclasses.dataclass(frozen=True)
class ImplicitAlong:
    """The derivatives of the residuals of a block, for a given change of its inputs, and those of all its unknowns,
    for a given change of the tearing variables, too.
    """

    residual: CFunction
    unknowns: CFunction
    n_moving: int


@dataclasses.dataclass(frozen=True)
class MovedRoot:
    """The derivative of the unknowns of an implicit block, by the implicit function theorem."""

    solve: Solve
    along: ImplicitAlong
    moving: tuple[tuple[Places, int], ...]
    tears: tuple[tuple[Places, int], ...]
    results: tuple[Places, ...]

    def write(self, writer: Writer) -> None:
        block = self.solve.block
        n = len(block.sizes)
        with writer.block(""), writer.loops(self.solve.count) as index:
            writer.line(f"double in[{max(block.n_inputs, 1)}], din[{self.along.n_moving}], x[{n}], dx[{n}];")
            self.solve.gather(writer, index)
            for name, operands in (("din", self.moving), ("x", self.tears)):
                start = 0
                for places, size in operands:
                    fill(writer, name, start, places, size, index)
                    start += size
            if np.any(block.sizes != 1.0):
                with writer.loops(n) as own:
                    place = own.variables[0] or "0"
                    writer.line(f"x[{place}] /= {writer.tables.of(block.sizes, 'f')}[{place}];")
            writer.line(f"{self.along.residual.name}(in, x, din, dx);")
            writer.line(f"move_root({block.equations.name}, in, x, dx, {n});")
            outputs = [operand(places, index, is_array=True) for places in self.results]
            writer.line(f"{self.along.unknowns.name}(in, x, din, dx, {', '.join(outputs)});")


@dataclasses.dataclass(frozen=True)
class Moved:
    """The derivatives of the unknowns of a direct block. If its function is long, it is called only if something that
    it reads moves.
    """

    call: Call

    @property
    def function(self) -> CFunction:
        return self.call.function

    def write(self, writer: Writer) -> None:
        pairs = zip(self.call.arguments, self.function.inputs, strict=True)
        moving = [(places, parameter) for places, parameter in pairs if places.space in ("dv", "dt")]
        shapes = [p.shape for _, p in moving] + [p.shape for p in self.function.outputs]
        is_single = self.call.count == 1 and not any(shapes)
        if len(self.function.body) <= LONG or not is_single or not moving:
            self.call.write(writer)
            return
        with writer.loops(1) as index:
            tests = [f"{operand(places, index, is_array=False)} != 0.0" for places, _ in moving]
            results = [operand(places, index, is_array=False) for places in self.call.results]
        with writer.block(f"if ({' || '.join(tests)})"):
            self.call.write(writer)
        writer.line("else")
        writer.line(f"    {' = '.join(results)} = 0.0;")


@dataclasses.dataclass(frozen=True)
class Along:
    """The functions and calls that compute the tangents of the values that the rates need, and those of the rest."""

    functions: list[CFunction]
    calls: list[Moved | MovedRoot]
    rest: list[Moved | MovedRoot]

    @property
    def has_roots(self) -> bool:
        """Whether the implicit function theorem is needed."""
        return any(isinstance(call, MovedRoot) for call in (*self.calls, *self.rest))


def along(model: CModel, *, with_rest: bool = False) -> Along:
    """The tangents of the rates, or of all values, from those of the states and of the time."""
    functions: dict[int, CFunction | ImplicitAlong] = {}
    calls: list[Moved | MovedRoot] = []
    groups, evaluations = model.groups(model.system.rates), model.rates
    if with_rest:
        groups, evaluations = [*groups, *model.groups_of_rest], [*evaluations, *model.rest]
    for group, evaluation in zip(groups, evaluations, strict=True):
        code, source = model.code(group), model.source(group)
        if id(code) not in functions:
            functions[id(code)] = _direct(source, code) if isinstance(code, Direct) else _implicit(source, code)
        own = functions[id(code)]
        if isinstance(code, Direct):
            assert isinstance(own, CFunction)
            calls.append(_call(model, group, code, own))
        else:
            assert isinstance(own, ImplicitAlong)
            assert isinstance(evaluation, Solve)
            calls.append(_moved(model, group, evaluation, own))
    found: list[CFunction] = []
    for item in functions.values():
        found += [item] if isinstance(item, CFunction) else [item.residual, item.unknowns]
    n = len(model.rates)
    return Along(found, calls[:n], calls[n:])


def _moving(source: Source, reads: Sequence[int]) -> list[int]:
    """The inputs that change along a direction: values and the time, but no parameters."""
    return [i for i in reads if i >= len(source.param_shapes)]


def tangents_of(closed: ClosedJaxpr, moving: Sequence[int]) -> ClosedJaxpr:
    """The changes of the outputs of a jaxpr, from all its inputs and then the changes of those that are `moving`."""
    n = len(closed.in_avals)

    def tangents(*values: Array) -> list[Array]:
        def outputs(*own: Array) -> list[Array]:
            changed = dict(zip(moving, own, strict=True))
            return jaxpr_as_fun(closed)(*(changed.get(i, x) for i, x in enumerate(values[:n])))

        return jax.jvp(outputs, tuple(values[i] for i in moving), values[n:])[1]

    shapes = [aval.shape for aval in closed.in_avals]
    return jax.make_jaxpr(tangents)(*structs([*shapes, *(shapes[i] for i in moving)]))


def _direct(source: Source, code: Direct) -> CFunction:
    moving = _moving(source, code.reads)
    names = [source.input_names[i] for i in code.reads] + [f"d_{source.input_names[i]}" for i in moving]
    whole = tangents_of(code.closed, [code.reads.index(i) for i in moving])
    piece, used = slice_outputs(whole, slice(None))
    outputs = [f"d_{name}" for name in source.output_names]
    function = function_of(source.named("along"), piece, [names[i] for i in used], outputs, source.tables, source.where)
    return dataclasses.replace(function, takes=used)


def _call(model: CModel, group: Group, code: Direct, function: CFunction) -> Moved:
    operands = model.operands(group)
    every = [operands[i] for i in code.reads]
    every += [_tangent(operands[i]) for i in _moving(model.source(group), code.reads)]
    results = tuple(
        _tangent(model.layout.values([use.gives[i] for use in group.uses])) for i in range(len(group.program.shapes))
    )
    return Moved(Call(results, (), function, tuple(every[i] for i in function.takes)))


def _tangent(places: Places) -> Places:
    return places._replace(space=f"d{places.space}")


def _implicit(source: Source, code: Implicit) -> ImplicitAlong:
    n_fixed, n_moving = code.n_fixed, code.n_inputs - code.n_fixed

    def residual(inputs: Array, x: Array, moving: Array) -> Array:
        fixed, own = inputs[:n_fixed], inputs[n_fixed:]
        return jax.jvp(lambda own: code.residual(fixed, own, x), (own,), (moving,))[1]

    def unknowns(inputs: Array, x: Array, moving: Array, dx: Array) -> list[Array]:
        fixed, own = inputs[:n_fixed], inputs[n_fixed:]
        return jax.jvp(lambda own, x: code.values(fixed, own, x), (own, x), (moving, dx))[1]

    n = len(code.sizes)
    shapes = [(code.n_inputs,), (n,), (n_moving,), (n,)]
    tables, where = source.tables, source.where
    return ImplicitAlong(
        function_of(
            source.named("equations_along"), jax.make_jaxpr(residual)(*structs(shapes[:3])), ["in", "x", "din"],
            ["residual"], tables, where, vectors=True,
        ),
        function_of(
            source.named("unknowns_along"), jax.make_jaxpr(unknowns)(*structs(shapes)), ["in", "x", "din", "dx"],
            [f"d_{own}" for own in source.output_names], tables, where, vectors=True,
        ),
        n_moving,
    )  # fmt: skip


def _moved(model: CModel, group: Group, solve: Solve, code: ImplicitAlong) -> MovedRoot:
    n_params, program = len(group.program.params), group.program
    moving = [(_tangent(places), size) for places, size in solve.inputs[n_params:]]
    sizes = [int(np.prod(shape)) for shape in program.shapes]
    tears = [(solve.results[i], sizes[i]) for i in range(len(program.steps), len(sizes))]
    return MovedRoot(solve, code, tuple(moving), tuple(tears), tuple(map(_tangent, solve.results)))


INSIDE = {"positive": "> 0.0", "nonnegative": ">= 0.0", "nonzero": "!= 0.0"}


def start_functions(model: CModel, has_events: bool) -> list[str]:
    """The start values as tables, and the function that sets them."""
    name = model.name
    tables = {
        "start_p": [q.value for q in model.parameters],
        "start_d": [q.value for q in model.discrete],
        "start_x": [q.value for q in model.states],
        "start_guess": [model.start_guess],
    }
    sizes = {"start_p": "p", "start_d": "d", "start_x": "x", "start_guess": "guess"}
    found = [array(key, np.concatenate([np.zeros(0), *values])) for key, values in tables.items()]
    lines = [f"    m->t = m->start = {model.t0!r};", "    m->count = 0;", "    m->failures = 0;"]
    lines += ["    m->refused = 0;"] * has_events
    for key, values in tables.items():
        size = sum(value.size for value in values)
        if size:
            lines += [f"    for (int i = 0; i < {size}; i++)", f"        m->{sizes[key]}[i] = {key}[i];"]
        else:
            found = [text for text in found if f" {key}[" not in text]
    return [*found, function(f"void {name}_start({name} *m)", lines)]


def rate_functions(model: CModel) -> list[str]:
    """The functions that evaluate the rates, and all values, at the time and states of the struct."""
    name, n = model.name, model.n_states
    head = f"static void evaluate_rates({name} *m)"
    writer = _writer(model)
    _copy_states(model, writer)
    for call in model.rates:
        call.write(writer)
    found = [function(head, writer.lines, unread=("m",))]
    writer = _writer(model)
    writer.line("evaluate_rates(m);")
    if n:
        with writer.loops(n) as index:
            writer.line(f"rates[{index.text}] = v[{index.through(model.rate_places).text}];")
    else:
        writer.line("(void)rates;")
    found.append(function(f"void {name}_rates({name} *m, double *rates)", writer.lines))
    writer = _writer(model)
    writer.line("evaluate_rates(m);")
    for call in model.rest:
        call.write(writer)
    return [*found, function(f"void {name}_evaluate({name} *m)", writer.lines)]


def _writer(model: CModel) -> Writer:
    return Writer(model.tables, model.name)


def _copy_states(model: CModel, writer: Writer) -> None:
    """Copy the states to the values: NaN for a state outside its range."""
    if model.n_states:
        with writer.loops(model.n_states) as index:
            writer.line(f"v[{index.text}] = m->x[{index.text}];")
    for ranges, places in model.state_ranges:
        for sign, factor in ranges:
            with writer.loops(len(places)) as index:
                value = f"v[{index.through(places).text}]"
                own = value if factor > 0 else f"-{value}"
                with writer.block(f"if (!({own} {INSIDE[sign.name]}))"):
                    writer.line(f"{value} = NAN;")


def output_functions(model: CModel) -> list[str]:
    """The function that evaluates the outputs."""
    writer = _writer(model)
    writer.line(f"{model.name}_evaluate(m);")
    for i, output in enumerate(model.outputs):
        writer.line(f"y[{i}] = {operand(output.places, Index(np.array(0), (), model.tables), is_array=False)};")
    return [function(f"void {model.name}_outputs({model.name} *m, double *y)", writer.lines, unread=("y",))]


def along_functions(model: CModel, along: Along) -> list[str]:
    """The derivative of the rates along a direction, at the point at which they were evaluated last."""
    name, n = model.name, model.n_states
    head = f"void {name}_along({name} *m, double dt, const double *dx, double *drates)"
    if not n:
        return [function(head, [], unread=("m", "dt", "dx", "drates"))]
    writer = _writer(model)
    with writer.loops(n) as index:
        writer.line(f"dv[{index.text}] = dx[{index.text}];")
    for call in along.calls:
        call.write(writer)
    with writer.loops(n) as index:
        writer.line(f"drates[{index.text}] = dv[{index.through(model.rate_places).text}];")
    return [function(head, writer.lines, unread=("dt",))]

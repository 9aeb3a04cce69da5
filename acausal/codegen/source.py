"""The C functions that evaluate a model: its start, rates, all values, outputs, and directional derivatives."""

import numpy as np

from .calls import operand
from .derivatives import Along
from .model import CModel
from .values import Index
from .write import array, function
from .writer import Writer

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

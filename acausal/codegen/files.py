"""The header and the source file of a model, with the requirements on its parameters and its hysteresis."""

import dataclasses
import json
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import diffrax
import jax.numpy as jnp
import numpy as np

from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._integrate.events.run_events import RunEvents
from .._integrate.setup.field import RunArgs
from .._integrate.setup.settings import RunNumbers, Settings
from .._integrate.solvers import Rodas5P
from .._reduce.class_equations import required
from .events import CEvents
from .expressions import SIGN
from .model import CModel
from .source import Along, along, along_functions, output_functions, rate_functions, start_functions
from .steps import step_functions
from .values import CValue, Index, stored
from .write import constants, enumeration, function, helpers, places_of, shared
from .writer import Writer, inlined


def requirement_functions(model: CModel) -> list[str]:
    """A function that returns the sentence of the first requirement that the parameters violate, or 0."""
    sentences = iter(model.system.intake.requirements.sentences)
    writer = Writer(model.tables, f"A requirement of {model.name}")
    for name in ("m", "p"):
        writer.names.new(name)
    for number, holder in enumerate(model.system.flat.holders):
        needed = required(holder.kind)
        if not needed.texts:
            continue
        for member in range(holder.total):
            values = [_parameter(model, (number, slot), member) for slot in needed.slots]
            for truth in writer.run(inlined(needed.jaxpr), values):
                condition = truth.at(Index(np.array(0), (), writer.tables)).inside(SIGN + 1)
                writer.line(f"if (!{condition})")
                writer.line(f"    return {json.dumps(next(sentences))};")
    writer.line("return 0;")
    head = f"const char *{model.name}_violation(const {model.name} *m)"
    return [function(head, writer.lines, unread=("m",), is_constant=True)]


def _parameter(model: CModel, key: tuple[int, int], member: int) -> CValue:
    kind, slot = key
    holder = model.system.flat.holders[kind]
    first = int(model.layout.members(key, np.array([member])).firsts[0])
    shape = holder.kind.sizes[slot]
    whole = stored("p", (model.layout.n_params + 1,), "f")
    return whole.moved((first + np.arange(int(np.prod(shape)))).reshape(shape))


def bands(system: System, inputs: Inputs) -> np.ndarray:
    """For each relation, the size of its event indicator below which it keeps its truth, as in `simulate`."""
    settings = Settings(
        system, None, None, None, None, None, "end", Rodas5P(), None, 1, 1, diffrax.NoProgressMeter()
    )  # fmt: skip
    one = jnp.asarray(1.0)
    args = RunArgs(inputs, RunNumbers(jnp.asarray(0.0), one, None, None, one, None, [], [], [], []))
    events = RunEvents(settings, settings.layout, is_reversible=False)
    return np.asarray(events.bands(args)[0])[: system.events.n_relations if system.events else 0]


Declarations: TypeAlias = list[tuple[str, str]]  # purposes and heads of functions


@dataclasses.dataclass(frozen=True)
class Code:
    """The texts of the files of a model."""

    header: str
    source: str


def events_of(model: CModel) -> CEvents | None:
    """The events of a model; None if it has none."""
    events = model.system.events
    return None if events is None else CEvents(model, events, bands(model.system, model.inputs))


def code_of(model: CModel, step: float, method: str) -> Code:
    """The header and the source file, with steps of a fixed size."""
    events = events_of(model)
    steps = step_functions(model, step, method, events is not None)
    has_matrix = method == "implicit" and model.n_states > 0
    title = f"C code of a model of acausal, with steps of {step!r} s ({method})"
    return Code(
        header_of(model, events, title, DECLARATIONS + STEP, has_matrix=has_matrix),
        source_of(model, events, along(model), steps, has_matrix=has_matrix),
    )


def source_of(
    model: CModel, events: CEvents | None, tangents: Along, more: Sequence[str], *, has_matrix: bool = False
) -> str:
    """The source file: the equations, their derivatives, the events, and `more` functions."""
    evaluations = [*model.rates, *model.rest]
    functions = [item.text for item in [*model.functions, *tangents.functions]]
    body = [
        *functions,
        *start_functions(model, events is not None),
        *rate_functions(model),
        *output_functions(model),
        *along_functions(model, tangents),
        *requirement_functions(model),
        *(events.functions() if events else []),
        *more,
    ]
    is_tied = events is not None and events.resets.is_tied
    has_matrix |= events is not None and bool(events.impacts)
    common = shared(evaluations, has_roots=tangents.has_roots, has_matrix=has_matrix, has_equations=is_tied)
    text = "\n\n".join([*common, *body])
    head = "\n".join([f'#include "{model.name}.h"', "#include <math.h>"])
    return "\n\n".join([head, *constants(model.tables), *helpers(text), text]) + "\n"


def header_of(
    model: CModel, events: CEvents | None, title: str, declarations: Declarations, *, has_matrix: bool = False
) -> str:
    """The header file: the struct of the model, the places of its numbers, and the public functions."""
    name, prefix = model.name, f"{model.name}_"
    guard = f"{name.upper()}_H"
    struct = [field.text for field in fields(model, events, has_matrix=has_matrix)]
    outputs = [(output.name, i, f"{output.name} [{output.unit}]") for i, output in enumerate(model.outputs)]
    parts = [
        f"/* {name}: {title}. */",
        f"#ifndef {guard}\n#define {guard}",
        "\n".join(["typedef struct {", *struct, f"}} {name};"]),
        places_of(f"{prefix}X_", model.states),
        places_of(f"{prefix}P_", model.parameters),
        places_of(f"{prefix}D_", model.discrete),
        enumeration(f"{prefix}Y_", outputs),
        f"enum {{ {prefix}N_X = {model.n_states}, {prefix}N_Y = {len(model.outputs)} }};",
        *_declared(name, declarations, has_events=events is not None),
        "#endif",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


class Field(NamedTuple):
    """A field of the C struct of a model; an array if it has a size."""

    type: str
    name: str
    size: int | None
    comment: str

    @property
    def text(self) -> str:
        size = "" if self.size is None else f"[{self.size}]"
        return f"    {self.type}{'' if self.type.endswith('*') else ' '}{self.name}{size}; /* {self.comment} */"


def fields(model: CModel, events: CEvents | None, *, has_matrix: bool) -> list[Field]:
    """The fields of the struct, in order."""
    n = model.n_states
    sizes = {
        "x": (n, "states"),
        "p": (model.layout.n_params, "parameters"),
        "d": (model.layout.n_discrete, "discrete variables"),
        "v": (model.layout.n_values, "states and unknowns, in the order of evaluation"),
        "dv": (model.layout.n_values, "their derivatives along a direction"),
        "guess": (len(model.start_guess), "starting points of iterations"),
    }
    if has_matrix:
        sizes["matrix"] = (n * n, "of a step")
    if events:
        sizes["due"] = (events.events.total, "next times of the time events, s")
        sizes["first"] = (events.n_times, "times of the time events, s")
        sizes["every"] = (events.n_times, "their periods, s")
    found = [
        Field("double", "t", None, "time, s"),
        Field("double", "start", None, "time of the first step, s"),
        Field("long", "count", None, "steps so far"),
        Field("int", "failures", None, "searches for the unknowns of a block that failed, so far"),
        *(Field("double", name, max(size, 1), comment) for name, (size, comment) in sizes.items()),
    ]
    if events:
        found += [
            Field("int", "truths", max(events.n_relations, 1), "of the relations in conditions"),
            Field("int", "holds", events.events.total, "the conditions of the events"),
            Field("int", "is_start", None, "whether no relation has a truth yet"),
            Field("const char *", "refused", None, "the reason why an event ended the run, or 0"),
        ]
    return found


def _declared(name: str, declarations: Declarations, *, has_events: bool) -> list[str]:
    """The public functions, each with its purpose."""
    found = declarations + (EVENT_DECLARATIONS if has_events else [])
    return [f"/* {purpose} */\n{declaration};".replace("MODEL", name) for purpose, declaration in found]


STEP = [
    ("A step, then its events: 1 if an event changed the model, -1 for a failure, else 0.", "int MODEL_step(MODEL *m)"),
]
DECLARATIONS = [
    ("Sets the parameters, discrete variables and states to their start values.", "void MODEL_start(MODEL *m)"),
    ("The sentence of a requirement that the parameters violate, or 0.", "const char *MODEL_violation(const MODEL *m)"),
    ("The outputs at the time and states of the struct.", "void MODEL_outputs(MODEL *m, double *y)"),
    ("The rates of the states.", "void MODEL_rates(MODEL *m, double *rates)"),
    ("All values, in v.", "void MODEL_evaluate(MODEL *m)"),
    (
        "The derivatives of the rates along a direction, at the point of the last evaluation.",
        "void MODEL_along(MODEL *m, double dt, const double *dx, double *drates)",
    ),
]
EVENT_DECLARATIONS = [
    (
        "The events at the start; 1 if they changed the model, -1 for a failure, else 0.",
        "int MODEL_initialise(MODEL *m)",
    ),
    (
        "The events at the time of the struct; 1 if they changed the model, -1 for a failure, else 0.",
        "int MODEL_events(MODEL *m)",
    ),
    (
        "The event indicators, positive if a relation holds, after MODEL_evaluate.",
        "void MODEL_indicators(const MODEL *m, double *indicator)",
    ),
    ("The next time event, s.", "double MODEL_next_time(const MODEL *m)"),
]

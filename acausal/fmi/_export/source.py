"""The C code of an FMU: the equations of the model, its variables, and the functions of FMI."""

from importlib.resources import files

import numpy as np

from ..._integrate.solvers import Rodas5P
from ...codegen.events import CEvents, leaf_value, starts_of, write_outputs
from ...codegen.model import CModel
from ...codegen.source import Along, tangents_of
from ...codegen.steps import pattern_tables, remember_function
from ...codegen.write import array, function
from ...codegen.writer import Writer
from .description import About, Variables

INCLUDES = """#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>"""
CANNOT_SET = (
    "Only inputs, parameters, states and discrete variables can be set: states and discrete variables until the end of "
    "the initialisation, parameters at events and between steps of co-simulation."
)


def part(name: str) -> str:
    """A file of C that all FMUs share."""
    return (files(__package__ or __name__) / "parts" / f"{name}.c").read_text().rstrip()


def fmu_source(model: CModel, about: About, variables: Variables, version: int) -> str:
    """The file fmu.c, which includes the equations."""
    tables = [
        _constants(model, about, variables),
        _places(variables),
        *pattern_tables(model, "fmu_"),
        *_method(),
        array("fmu_nominal", model.system.nominals),
        array("fmu_own_state", np.array(variables.state_places), "i"),
        array("fmu_rate_place", model.rate_places[variables.state_places], "i"),
    ]
    shared = "\n\n".join(part(name) for name in ("instance", "integrate", "both", f"fmi{version}"))
    shared = shared.replace("MODEL", model.name).replace("FMI_", f"fmi{version}")
    return "\n\n".join([INCLUDES, f'#include "{model.name}.c"', *tables, shared]) + "\n"


def _constants(model: CModel, about: About, variables: Variables) -> str:
    lines = [
        f'#define TOKEN "{about.token}"',
        f'#define CANNOT_SET "{CANNOT_SET}"',
        f"#define N_VARIABLES {len(variables.all)}",
        f"#define N_ALL {model.n_states} /* states of the equations: those of the FMU, and its inputs */",
        f"#define N_OWN {len(variables.state_places)} /* states of the FMU */",
        f"#define N_INDICATORS {len(variables.indicators)}",
    ]
    return "\n".join(lines + ["#define HAS_EVENTS"] * (model.system.events is not None))


def _places(variables: Variables) -> str:
    # The modes in which a variable can be set: none; before the start; also between steps; or also during a step.
    settable = [
        3 if v.causality == "input" else 2 if v.space == "p" else int(v.space in ("x", "d")) for v in variables.all
    ]
    spaces = "".join(v.space for v in variables.all)
    return "\n\n".join(
        [
            "/* Where the values of the variables are. */",
            f'static const char fmu_space_of[] = "{spaces}";',
            array("fmu_place_of", np.array([v.place for v in variables.all]), "i"),
            array("fmu_sign_of", np.array([v.sign for v in variables.all]), "i"),
            array("fmu_settable", np.array(settable, int), "i"),
        ]
    )


def _method() -> list[str]:
    """The coefficients of Rodas5P."""
    tableau = Rodas5P.tableau
    stages, rows = len(tableau.a), len(tableau.dense)
    return [
        f"#define STAGES {stages}\n#define DENSE {rows}",
        f"static const double fmu_gamma = {tableau.gamma!r};",
        array("fmu_stage_time", tableau.alpha_sums),
        array("fmu_stage_slope", tableau.gamma_sums),
        _matrix("fmu_stage_a", tableau.a),
        _matrix("fmu_stage_c", tableau.c),
        _matrix("fmu_dense", tableau.dense),
    ]


def _matrix(name: str, values: np.ndarray) -> str:
    rows = ",\n".join("    {" + ", ".join(repr(float(x)) for x in row) + "}" for row in values)
    return f"static const double {name}[{len(values)}][{values.shape[1]}] = {{\n{rows},\n}};"


def own_functions(model: CModel, events: CEvents | None, tangents: Along) -> list[str]:
    """The functions of an FMU beside the equations: derivatives of all values along a direction, at the point of the
    last evaluation, those of the event indicators, and the memory of iterations.
    """
    name, n = model.name, model.n_states
    writer = Writer(model.tables, name)
    if n:
        with writer.loops(n) as index:
            writer.line(f"dv[{index.text}] = dx[{index.text}];")
    else:
        writer.line("(void)dx;")
    for call in (*tangents.calls, *tangents.rest):
        call.write(writer)
    head = f"static void {name}_along_all({name} *m, double dt, const double *dx)"
    found = [function(head, writer.lines, unread=("m", "dt", "dx")), remember_function(model)]
    return found if events is None else [*found, _indicators_along(model, events)]


def _indicators_along(model: CModel, events: CEvents) -> str:
    """The derivatives of the event indicators along the direction of the values."""
    of, leaves = events.events.indicators, model.system.flat.leaves
    moving = [i for i, leaf in enumerate(of.leaves) if leaves[leaf].declaration.is_variable]
    writer = Writer(model.tables, f"An event of {model.name}")
    for taken in ("m", "t", "dt", "v", "dv", "p", "d", "indicator"):
        writer.names.new(taken)
    values = [leaf_value(writer, model.layout, leaf) for leaf in of.leaves]
    values += [leaf_value(writer, model.layout, of.leaves[i], is_tangent=True) for i in moving]
    targets = [("indicator", start) for start in starts_of(of.closed)]
    write_outputs(writer, tangents_of(of.closed, moving), values, targets)
    head = f"static void {model.name}_indicators_along(const {model.name} *m, double dt, double *indicator)"
    return function(head, writer.lines, unread=("m", "dt", "indicator"), is_constant=True)

"""Steps of a fixed size in C."""

import numpy as np

from .._errors import ModelError
from .._evaluate.dependence import dependence
from .._sparse_matrix import column_colours
from .model import CModel
from .write import array, function, part
from .writer import Writer

METHODS = ("implicit", "explicit", "rk4")


def step_functions(model: CModel, step: float, method: str, has_events: bool) -> list[str]:
    """The functions and tables of steps of this size."""
    defines = [f"#define STEP {step!r} /* s */", f"#define N_STATES {model.n_states}"]
    integrate = [part(f"step_{method}")] if model.n_states else [NOTHING]
    tables = pattern_tables(model) if method == "implicit" and model.n_states else []
    step_part = part("step") if has_events else part("step").replace("return MODEL_events(m);", "return 0;")
    found = ["\n".join(defines), *tables, remember_function(model), *integrate, step_part]
    return [text.replace("MODEL", model.name) for text in found]


NOTHING = "static int integrate(MODEL *m)\n{\n    remember(m);\n    return 1;\n}"


def remember_function(model: CModel) -> str:
    """The solutions of nonlinear blocks become the guesses of the next step."""
    writer = Writer(model.tables, model.name)
    plan, layout = model.system.plan, model.layout
    own = [layout.place(pair) + np.arange(plan.size(pair[0])) for pair in model.system.carried.memory]
    places = np.concatenate([np.zeros(0, int), *own])
    if len(places):
        with writer.loops(len(places)) as index:
            found = f"v[{index.through(places).text}]"
            writer.line(f"if (isfinite({found}))")
            writer.line(f"    m->guess[{index.text}] = {found};")
    return function(f"static void remember({model.name} *m)", writer.lines, unread=("m",), is_constant=True)


def pattern_tables(model: CModel, prefix: str = "") -> list[str]:
    """The elements of the Jacobian that may differ from zero, and the columns that are computed together."""
    structure = dependence(model.system.plan, model.system.rates)
    colours = column_colours(structure)
    entries = structure.tocoo()
    defines = [f"#define N_COLOURS {int(colours.max(initial=-1)) + 1}", f"#define N_ENTRIES {entries.nnz}"]
    return [
        "\n".join(defines),
        array(f"{prefix}colour", colours, "i"),
        array(f"{prefix}row_of", entries.row, "i"),
        array(f"{prefix}column_of", entries.col, "i"),
    ]


def check_step(step: float, method: str) -> None:
    """Raise `ModelError` for a step that is not positive, or an unknown method."""
    if method not in METHODS:
        raise ModelError(f"method must be one of {', '.join(METHODS)}, not {method!r}.")
    if not (np.isfinite(step) and step > 0.0):
        raise ModelError(f"step must be a positive number of seconds, not {step!r}.")

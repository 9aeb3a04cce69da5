"""`export_c`: writes a model with known numbers as C code, with a small program that runs it and prints its outputs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .._declare.component import Component
from .._declare.history import past_of
from .._declare.layout import complete_leaves
from .._errors import ModelError, listed, suggestion
from .._evaluate.building import check_structure, system_of
from .._evaluate.initial import checked_names, initial_state
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._integrate.setup.options import names_of
from .._integrate.start.initialise import initialised_leaves, needs_search
from .._tracing import is_traced
from .._unit_check.signal_units import unit_of_leaf
from .expressions import identifier
from .files import code_of
from .layout import Numbering, Places, Quantity
from .model import CModel, Output
from .steps import check_step
from .values import Tables


def c_model(
    model: Component, name: str | None = None, outputs: Sequence[str] | None = None, t0: float = 0.0,
    system: System | None = None,
) -> CModel:  # fmt: skip
    """The model as C functions and their calls; see `export_c` for the arguments."""
    if system is None:
        system = system_of(model)
    else:
        check_structure(model, system, "The exported model")
    if system.solved is not None:
        raise ModelError("The exported system must not be in mass-matrix form. Remedy: leave `system` out.")
    if system.ordered.invariants:
        restricted = ", ".join(system.ordered.table.row_name(row) for row in sorted(system.ordered.invariants))
        raise ModelError(
            f"The states of this model are restricted by invariants ({restricted}), onto which C code with fixed steps "
            "does not project. Remedy: declare a variable `never`, so that fewer states remain (see structure(model))."
        )
    _check_events(system)
    leaves = complete_leaves(model)[0]
    if any(is_traced(leaf) for leaf in leaves):
        raise ModelError(
            "The exported model must have known numbers. Remedy: export it outside of jax.jit, jax.grad and jax.vmap."
        )
    system.intake.check(leaves)
    inputs = system.intake.inputs_of(leaves)
    layout = Numbering(system)
    discrete = {i: np.asarray(value, float) for i, value in inputs.params.leaves.items() if i in layout.discrete}
    if needs_search(system, leaves):
        # The events at the start, which C code executes itself, begin with the discrete variables of the model.
        inputs = system.intake.inputs_of(initialised_leaves(system, leaves, t0, past_of(model))[0])
    numbers = {i: np.asarray(value, float) for i, value in inputs.params.leaves.items()} | discrete
    return CModel(
        identifier(name or system.name),
        system,
        inputs,
        layout,
        Tables(),
        layout.quantities(layout.params, numbers),
        layout.quantities(layout.discrete, numbers),
        _states(system, layout, inputs, t0),
        _outputs(system, layout, outputs),
        np.asarray(system.starts.values(inputs, system.carried.memory)),
        t0,
    )


def _check_events(system: System) -> None:
    events = system.events
    names = (
        [entry.label(0) for entry in events.entries if entry.kind in ("follow", "started", "remember")]
        if events
        else []
    )
    if names:
        raise ModelError(
            f"The events {listed(names)} have no C form: C code has neither `follow`, `started` nor `remember`. "
            "Remedy: state these changes with when(...) or at(...), and delays with PadeDelay or SampledDelay."
        )


def _states(system: System, layout: Numbering, inputs: Inputs, t0: float) -> list[Quantity]:
    y, bad = initial_state(system, t0, inputs)
    if np.any(np.asarray(bad)):
        names = [
            name for name, is_bad in zip(checked_names(system, inputs.given), np.asarray(bad), strict=True) if is_bad
        ]
        raise ModelError(
            f"The start values of {', '.join(dict.fromkeys(names))} contradict the constraints. Remedy: correct them, "
            "or export the result of `initialise`."
        )
    table, found = system.ordered.table, []
    for pair, start in zip(system.states, system.plan.starts.tolist(), strict=False):
        unit = layout.unit(pair[0])
        value = np.asarray(y)[start : start + system.plan.size(pair[0])]
        found.append(Quantity(table.variable_name(*pair), unit + "/s" * pair[1], start, value))
    return found


def _outputs(system: System, layout: Numbering, names: Sequence[str] | None) -> list[Output]:
    flat = system.flat
    known = {
        leaf.name(i): (leaf, number, i)
        for number, leaf in enumerate(flat.own_leaves)
        if leaf.declaration.role != "param"
        for i in range(leaf.count)
    }
    if names is None:
        shown = {name: leaf for name, (leaf, *_) in known.items() if "._" not in f".{name}"}
        names = [name for name, leaf in shown.items() if leaf.declaration.is_variable and not leaf.in_port]
    found = []
    for name in names_of(names, "outputs"):
        if name not in known:
            raise ModelError(f"The model has no variable {name!r}.{suggestion(name, known)}")
        leaf, number, i = known[name]
        size = int(np.prod(leaf.sizes))
        if leaf.declaration.role == "discrete":
            places = Places("d", np.array([layout.discrete[number] + i * size]))
        else:
            places = layout.node(leaf.first + i)
        for k in range(size):
            own = f"{name}[{k}]" if leaf.sizes else name
            found.append(Output(own, unit_of_leaf(flat, number), places._replace(firsts=places.firsts + k)))
    return found


SHOWN = 6  # number of outputs that the example prints

EXAMPLE = """/* Prints outputs of NAME every 100 steps. Compile with: cc -O2 -std=c99 main.c NAME.c -lm */
#include "NAME.h"
#include <stdio.h>

int main(void)
{
    static NAME m;
    double y[NAME_N_Y + 1];
    NAME_start(&m);
    /* Here is the place to set parameters and start values, such as m.p[NAME_P_...] = 1.0; */
    if (NAME_violation(&m)) {
        printf("%s\\n", NAME_violation(&m));
        return 1;
    }
INITIALISE    for (int step = 0; step <= 1000; step++) {
        if (step % 100 == 0) {
            NAME_outputs(&m, y);
            printf(FORMAT);
        }
        if (NAME_step(&m) < 0)
            return 1;
    }
    return 0;
}
"""


def main_example(model: CModel) -> str:
    """The text of the program."""
    shown = range(min(len(model.outputs), SHOWN))
    values = ["m.t", *(f"y[{i}]" for i in shown)]
    form = f'"{" ".join(["%g"] * len(values))}\\n", {", ".join(values)}'
    start = "    if (NAME_initialise(&m) < 0)\n        return 1;\n" if model.system.events else ""
    return EXAMPLE.replace("FORMAT", form).replace("INITIALISE", start).replace("NAME", model.name)


def export_c(
    model: Component,
    directory: str | Path,
    *,
    step: float,
    method: str = "implicit",
    outputs: Sequence[str] | None = None,
    name: str | None = None,
    t0: float = 0.0,
    system: System | None = None,
) -> CModel:
    """Write a model as C99 code for a target in real time: NAME.h, NAME.c and an example, main.c.

    The code takes steps of `step` seconds by a `method`: "implicit" (linearly implicit Euler, for stiff models),
    "explicit" (Euler) or "rk4" (Runge-Kutta of order 4). Events happen at the end of a step. `outputs` are the names of
    variables that the code makes available, by default all that are not in ports. The parameters and start values are
    those of the model at the time `t0`, and can be changed at run time. `name` is that of the files and of the C
    functions, by default the class of the model. `system` is a result of `choose_states`.

    Returns the numbered system behind the files.

    Raises `ModelError` for an unknown output, for an operation without a C form, and for a model whose states or events
    C code with fixed steps cannot handle.
    """
    check_step(step, method)
    found = c_model(model, name, outputs, t0, system)
    code = code_of(found, float(step), method)
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    texts = {f"{found.name}.h": code.header, f"{found.name}.c": code.source, "main.c": main_example(found)}
    for file, text in texts.items():
        (folder / file).write_text(text)
    return found

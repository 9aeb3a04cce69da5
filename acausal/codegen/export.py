"""`export_c`: writes a model as C code."""

from collections.abc import Sequence
from pathlib import Path

from .._declare.component import Component
from .._evaluate.system import System
from .files import code_of
from .main_example import main_example
from .model import CModel
from .prepare import c_model
from .steps import check_step


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

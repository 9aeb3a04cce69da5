"""C code of models, for real-time targets and for tools that call compiled models.

`export_c` writes it.
"""

# From a model to its files: `prepare.c_model` numbers all parameters, states and values. `CModel` (`model.py`) calls C
# functions on them, one for each program of the sorted system (`programs.py`). `derivatives.along` does the same for
# tangents, `CEvents` (`events.py`) for events. `functions.function_of` makes a C function of a jaxpr: `Writer` collects
# its statements; `primitives.py`, `arrays.py` and `control_flow.py` hold the form of each operation. `files.py` puts
# the texts together with the parts that all models share (`parts`).

from .export import export_c as export_c

__all__ = ["export_c"]

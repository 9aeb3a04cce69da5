"""Linear systems for other libraries."""

from typing import Any

import numpy as np

from .._extras import needed


def to_control(system: Any) -> Any:
    """A `control.StateSpace`; see `LinearSystem.to_control`."""
    control = needed("control", "control", "to_control()")
    matrices = [np.asarray(matrix) for matrix in (system.A, system.B, system.C, system.D)]
    names = {
        role: [name.replace(".", "_") for name in getattr(system, role)] for role in ("states", "inputs", "outputs")
    }
    return control.StateSpace(*matrices, **names)

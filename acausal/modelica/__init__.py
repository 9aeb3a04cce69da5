"""Modelica models as differentiable components.

`load` translates a Modelica model, with the libraries that it uses, into a component like any other: for `simulate`,
`initialise`, `linearise`, `optimise`, `jax.jit`, `jax.vmap` and gradients.

    from acausal import simulate
    from acausal.modelica import load

    drive = load("Drive.mo", "Drive", roots=["libraries"])
    solution = simulate(drive, 2.0)
    solution["inertia2.w"]

`source` tells where a value comes from. `python -m acausal.modelica` checks and simulates models, and compares a
library with published results.
"""

from ._errors import ModelicaError as ModelicaError
from ._errors import ModelicaWarning as ModelicaWarning
from ._load import load as load
from ._source import source as source
from ._syntax.flat import ExperimentAnnotation as ExperimentAnnotation
from ._syntax.flat import SourcePlace as SourcePlace
from ._translate.model import ModelicaModel as ModelicaModel

__all__ = ["ExperimentAnnotation", "ModelicaError", "ModelicaModel", "ModelicaWarning", "SourcePlace", "load", "source"]

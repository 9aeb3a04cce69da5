"""Loading of Modelica models."""

import warnings
from collections.abc import Sequence
from pathlib import Path

from .._errors import ModelError
from .._garbage import seldom_collected
from ._deep_calls import deep_calls
from ._errors import ModelicaError, ModelicaWarning
from ._frontend.references import without_indices
from ._frontend.stored import stored_model
from ._syntax.flat import FlatModelica
from ._translate.build import component
from ._translate.model import ModelicaModel


def load(source: str | Path, model: str, roots: str | Path | Sequence[str | Path] = ()) -> ModelicaModel:
    """Load a Modelica model as a component.

    - `source`: a Modelica text, a file, or the folder of a package. It may be empty if `roots` hold the model.
    - `model`: the full name of the model, possibly with modifiers, as in "Plant.Pump(k=2)".
    - `roots`: the folder, or folders, with the libraries that it uses. The Modelica Standard Library lies in such a
      folder as `Modelica 4.1.0`, `ModelicaServices 4.1.0` and `Complex 4.1.0.mo`, as in its release.

    Real parameters and start values are attributes by their Modelica path, as in `model.inertia1.J`. Members of
    arrays of components count from 1, as in Modelica (`model.cell[1]`); arrays of numbers are arrays of jax, which
    count from 0. A name that Python or `Component` uses gets an underscore at its end (`lambda_`). A parameter
    whose value a model states by an expression of other parameters follows them. Parameters of other types
    (Integer, Boolean, enumerations, String), and real ones on which the structure depends, are fixed: set them by
    modifiers.

    Raises `ModelicaError` for errors of the text, with file, line and column, and for language elements that are not
    supported. Some of the latter appear only in the analysis of the equations, as `ModelError`. Warns with
    `ModelicaWarning` of a parameter without a value or start value, which is 0, false or empty, of a library in another
    version than the one that a class uses, and of an inner component that the model lacks and gets by default.
    """
    roots = [roots] if isinstance(roots, str | Path) else roots
    try:
        with seldom_collected(), deep_calls():
            flat = stored_model(source, model, roots)
            found = component(flat)
    except ModelicaError:
        raise
    except ModelError as error:
        raise ModelicaError(f"{model}: {error}") from error
    if missing := _without_values(flat):
        parts = without_indices(missing[0]).split(".")
        modifier = "(".join(parts) + "=..." + ")" * (len(parts) - 1)
        warnings.warn(
            f"{model}: these parameters have no value, and are 0, false or empty: {', '.join(missing)}. Remedy: give "
            f"their values by modifiers, as in {flat.name}({modifier}).",
            ModelicaWarning,
            stacklevel=2,
        )
    for message in flat.warnings:
        warnings.warn(message, ModelicaWarning, stacklevel=2)
    return found


def _without_values(flat: FlatModelica) -> list[str]:
    """The parameters that neither the model nor a start value gives a value."""
    return [
        one.name
        for one in flat.variables.values()
        if one.variability == "parameter"
        and one.binding is None
        and one.start is None
        and all(one.fixed or (True,))
        and not one.is_expandable
        and 0 not in one.dims
    ]

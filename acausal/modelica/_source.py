"""Where the values of a Modelica model come from."""

from .._errors import UnknownNameError, suggestion
from ._syntax.flat import SourcePlace
from ._translate.model import ModelicaModel
from ._translate.tree import attribute_path


def source(model: ModelicaModel, path: str) -> SourcePlace:
    """Where a Modelica text states the value of a parameter, or the start value of a variable.

    `path` is a Modelica name or the path of an attribute, such as "gear.ratio". The result is the file and line of the
    modifier that gives the value, or if there is none, of the declaration: `print(source(drive, "gear.ratio"))`
    prints `Drive.mo:12`. Raises `UnknownNameError` for a path that the model does not have.
    """
    variables = type(model).flat.variables
    names = {attribute_path(name): name for name in variables}
    name = path if path in variables else names.get(path) or path.rpartition("[")[0]
    found = variables.get(name)
    if found is None or found.stated is None:
        raise UnknownNameError(f"The model has no parameter or variable {path!r}.{suggestion(path, list(variables))}")
    return found.stated

"""The errors of Modelica models."""

from .._errors import ModelError


class ModelicaError(ModelError):
    """A Modelica text that cannot become a component. The message names the place in the text, if it is known."""

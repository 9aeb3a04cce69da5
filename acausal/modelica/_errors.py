"""The errors of Modelica models."""

from .._errors import ModelError


class ModelicaError(ModelError):
    """A Modelica text that cannot become a component. The message names the place in the text, if it is known."""


class ModelicaWarning(UserWarning):
    """A property of a Modelica text that can change the results. The message names the place and the remedy."""

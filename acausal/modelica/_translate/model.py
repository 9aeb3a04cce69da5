"""The component class of translated models."""

from collections.abc import Mapping
from typing import ClassVar

from ..._declare.component import Component


class ModelicaModel(Component, partial=True):
    """A Modelica model. Parameters and variables are attributes by their Modelica path, as in `model.inertia1.w`.

    Members of arrays of components count from 1, as in Modelica: `model.cell[1]` is the first.
    """

    modelica_names: ClassVar[Mapping[str, str]] = {}

"""The annotations `experiment` and `missingInnerMessage`."""

from .._syntax.flat import ExperimentAnnotation
from . import tree as t
from .classes import ComponentElement
from .expressions import Expressions

_EXPERIMENT = {"StartTime": "start", "StopTime": "stop", "Tolerance": "tolerance", "Interval": "interval"}


def experiment(here: Expressions) -> ExperimentAnnotation:
    """The annotation of a model, or of the nearest base class that has one (Modelica 3.6, section 18.4)."""
    for base in reversed(list(here.scope.lineage())):
        for found in base.tree.annotation.named("experiment") if base.tree.annotation else ():
            stated = [one for one in found.modification.arguments if isinstance(one, t.ElementModification)]
            pairs = [(_EXPERIMENT.get(one.name[0]), one.modification.value) for one in stated]
            return ExperimentAnnotation(**{key: float(here.known(x, "`experiment`")) for key, x in pairs if key and x})
    return ExperimentAnnotation()


def missing_inner(here: Expressions, outer: ComponentElement) -> str:
    """The warning of an inner component that a model lacks and gets by default (Modelica 3.6, section 5.4). `here` is
    the class of the outer component.
    """
    prototype, user = outer.prototype, outer.holder.path or "the model"
    stated = prototype.annotation("missingInnerMessage")
    said = [
        f"{user} has no component `inner {outer.name}` around it, and the model gets one with default values.",
        *("" if stated is None else str(here.known(stated, "`missingInnerMessage`"))).split(),
        f"Remedy: declare `inner {prototype.element.path} {outer.name};` in the model.",
    ]
    return str(outer.error(" ".join(said)))

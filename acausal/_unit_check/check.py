"""Unit check of a whole model."""

from .._errors import UnitError, complain
from .._reduce.flat_model import FlatModel, Instances, Kind
from .composites import accounting_composites
from .kinds import kind_units
from .signals import signal_problems

_REMEDY = (
    "Remedy: correct the equation or the declared unit, and turn a constant with a unit into a parameter. A leaf with "
    "the unit '' fits any; eq(..., check_units=False) disables the check of an equation."
)


def unit_problems(flat: FlatModel) -> list[str]:
    """All contradictions between the declared units and the equations, energy accounts and connections of a model."""
    places = [(_instances(instances), instances.kind) for instances in flat.instances]
    others = {starters.kind: _instances(starters) for starters in flat.starters}
    others |= {kind: path for path, kind in accounting_composites(flat)}
    known = {kind for _, kind in places}
    places += [(path, kind) for kind, path in others.items() if kind not in known]
    found = [
        f"{_named(kind, place)}, {where}: {problem}" + ("" if problem.endswith("?") else ".")
        for place, kind in places
        for where, problem in kind_units(kind).problems
    ]
    return found + signal_problems(flat)


def check_units(flat: FlatModel) -> None:
    """Raise `UnitError` with all unit problems of a model."""
    found = unit_problems(flat)
    if found:
        complain(UnitError("\n  ".join(["The units of the model do not agree.", *found, _REMEDY])))


def unchecked_equations(flat: FlatModel) -> list[str]:
    """The equations with `check_units=False`, by path; those of an array of components once."""
    return [
        f"{path}.{name}" if path else name
        for instances in flat.instances
        for path in instances.paths
        for name in kind_units(instances.kind).unchecked
    ]


def _instances(instances: Instances) -> str:
    others = instances.total - 1
    return f"{instances.name(0)} and {others} more" if others else instances.name(0)


def _named(kind: Kind, place: str) -> str:
    return f"{kind.cls.__name__} ({place})" if place else kind.cls.__name__

"""What an author of components writes: `Component`, its equations, connections and energy account."""

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, TypeAlias

import equinox as eqx

from .._numbers import Numbers, Truth
from .annotations import Scalar
from .class_help import class_html
from .node import Node, Port
from .past import Past
from .sizes import Sizes, as_sizes, checked_sizes, sizes_of
from .tree import as_html, as_text, branch, folded


class Equation(NamedTuple):
    """An equation, kept as its residual: left side minus right side."""

    residual: Numbers
    check_units: bool = True


Equations: TypeAlias = dict[str, Equation]


def eq(left: Numbers, right: Numbers = 0.0, *, check_units: bool = True) -> Equation:
    """State that `left` equals `right`; the two need the same shape, or one of them is a scalar.

    `check_units=False` is for a law between numbers, such as an empirical one, whose units do not agree.
    """
    if isinstance(right, int | float) and right == 0:
        return Equation(left, check_units)
    return Equation(left - right, check_units)


class When(NamedTuple):
    """An event: at the moment at which `condition` becomes true, variables take new values."""

    condition: Truth | Numbers
    changes: dict[str, Numbers]


class At(NamedTuple):
    """An event at known times, and after each of them again in equal intervals where `every` is given."""

    time: Numbers
    every: Numbers | None
    changes: dict[str, Numbers]


class Refuse(NamedTuple):
    """A condition that must not come true, and what to say if it does."""

    condition: Truth | Numbers
    reason: str


Event: TypeAlias = When | At | Refuse
Events: TypeAlias = dict[str, Event]


def when(condition: Truth | Numbers, **changes: Numbers) -> When:
    """State what happens as soon as `condition` becomes true, as in `when(self.h < 0.0, v=-self.e * self.v)`.

    `condition` is a relation between real numbers, or several joined by `&`, `|` and `~`; a real number counts as true
    above zero. The event happens when it becomes true, and again only after it was false. `changes` gives new values
    of discrete variables and of variables of the component, by name, computed from the values before the event.
    """
    return When(condition, changes)


def at(time: Numbers, *, every: Numbers | None = None, **changes: Numbers) -> At:
    """State what happens at a time in s that parameters and discrete variables tell: steps end there.

    `time` is one time or an array of them; with `every`, each comes again after this interval, without end. What was
    due before the start of a run happens at its start. Without `changes`, it tells of times at which equations change,
    such as the knots of a profile: `at(self.times)`.
    """
    return At(time, every, changes)


def refuse(condition: Truth | Numbers, reason: str) -> Refuse:
    """State that a component cannot work where `condition` is true: a run ends there with an error that tells why."""
    return Refuse(condition, reason)


class Connection(NamedTuple):
    """Ports that are joined."""

    ports: tuple[Port, ...]


Connections: TypeAlias = tuple[Connection, ...]


def connect(*ports: Port) -> Connection:
    """Join two or more ports of one kind: their across variables become equal, their flows sum to zero.

    Ports of arrays are joined member by member; a single port is joined with every member of an array.
    """
    return Connection(ports)


class Energy(NamedTuple):
    """The energy account of a component: power through its ports + `supplied` = d(stored)/dt + `dissipated`.

    `stored` in J is a function of the component's variables; `dissipated` (never negative) and `supplied` (by a source,
    from outside the model) in W.
    """

    stored: Scalar = 0.0
    dissipated: Scalar = 0.0
    supplied: Scalar = 0.0


class Component(Node, partial=True):
    """A part of a model: parameters, variables and ports, with the equations that relate them.

    A *final* component states `equations`, or joins sub-components by `connections`, or both. A *partial* one
    (`class TwoPin(Component, partial=True)`) holds what several final ones share and cannot be instantiated.

    `nominal` gives sizes of variables where those of their units do not fit, as in `Capacitor(C=1e-9, nominal=dict(
    v=1e-5))`: see `sized`. `if_singular` says what it means, and what to do, where the component's equations become
    singular in a run. `elsewhere` tells what names of other libraries are here, as in `{"freqHz": "frequency"}`, for
    the answer to those who use them.
    """

    if_singular: ClassVar[str] = ""
    elsewhere: ClassVar[Mapping[str, str]] = {}
    nominal: Mapping[str, object] = eqx.field(
        static=True, kw_only=True, default=Sizes(), converter=as_sizes, repr=False
    )
    _past: Past | None = eqx.field(init=False, default=None, repr=False, metadata={"is_past": True})

    def __check_init__(self) -> None:
        if sizes := sizes_of(self):
            object.__setattr__(self, "nominal", checked_sizes(self, sizes))
        object.__setattr__(self, "_past", None)

    def __str__(self) -> str:
        """The parts as a tree, with values in their units."""
        return as_text(branch(self))

    def _repr_html_(self) -> str:
        """The same for a notebook, where parts fold, with the documentation of the class."""
        return as_html(branch(self)) + folded(type(self).__name__, class_html(type(self)))

    def equations(self, d: Any) -> Equations:
        """The equations by name; `d` has the shape of `self` and holds the time derivatives of its variables."""
        return {}

    def initial_equations(self, d: Any) -> Equations:
        """The equations by name that hold at the start, besides `equations`, between variables and their derivatives.

        Start values that are not given follow from them, those of the component itself first.
        """
        return {}

    def connections(self) -> Connections:
        """The connections among the ports of this component and of its parts."""
        return ()

    def events(self) -> Events:
        """The events by name, as functions of the component's variables. Those whose names begin with an underscore are
        not listed in the log of a run.
        """
        return {}

    def energy(self) -> Energy | None:
        """The energy account as a function of the component's variables; None where it holds and loses nothing."""
        return None

"""The interface for authors of components: `Component`, its equations, connections, events and energy account."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, TypeAlias

import equinox as eqx

from .._errors import ModelError
from .._numbers import Numbers, Truth
from .annotations import Scalar
from .class_help import class_html
from .history import Past, Remember
from .node import Node, Port
from .sizes import Sizes, as_sizes, checked_sizes, sizes_of
from .tree import as_html, as_text, branch, folded


class Equation(NamedTuple):
    """An equation, stored as its residual: left side minus right side."""

    residual: Numbers
    check_units: bool = True


Equations: TypeAlias = dict[str, Equation]


def eq(left: Numbers, right: Numbers = 0.0, *, check_units: bool = True) -> Equation:
    """State that `left` equals `right`. Both have the same shape, or one is a scalar.

    `check_units=False` is for an empirical law between numbers whose units do not agree.
    """
    if isinstance(right, int | float) and right == 0:
        return Equation(left, check_units)
    return Equation(left - right, check_units)


class When(NamedTuple):
    """An event: when `condition` becomes true, variables take new values."""

    condition: Truth | Numbers
    changes: dict[str, Numbers]
    check_units: bool = True


class At(NamedTuple):
    """An event at known times, repeated after the interval `every` if that is given."""

    time: Numbers
    every: Numbers | None
    changes: dict[str, Numbers]
    check_units: bool = True


class Sampling(At):
    """A repeated event that happens together with the others of its instant: Modelica's sample(time, every). Other
    repeated events wait for those of their instant.
    """

    __slots__ = ()


class Refuse(NamedTuple):
    """A condition that ends a run with an error, and its reason."""

    condition: Truth | Numbers
    reason: str
    check_units: bool = True


class Impact(NamedTuple):
    """An event with an impulse, and a contact that can share the impulses of other ones."""

    condition: Truth | Numbers
    closed: Truth | Numbers
    speed: Numbers
    after: Numbers
    acceleration: Numbers
    changes: dict[str, Numbers]
    force: str


class Yields(NamedTuple):
    """Values of discrete variables during an impulse."""

    changes: dict[str, Numbers]


class Follow(NamedTuple):
    """Discrete variables that the event iteration makes equal to values."""

    changes: dict[str, Numbers]
    check_units: bool = True


class Started(NamedTuple):
    """An event once, at the start of a run."""

    changes: dict[str, Numbers]
    check_units: bool = True


Event: TypeAlias = When | At | Refuse | Impact | Yields | Follow | Started | Remember
Events: TypeAlias = dict[str, Event]


def _flag(check_units: object, where: str) -> bool:
    # Numbers in its type allow callers to unpack a dictionary of numbers.
    if not isinstance(check_units, bool):
        raise ModelError(f"{where}(..., check_units={check_units!r}): it must be True or False.")
    return check_units


def when(condition: Truth | Numbers, *, check_units: Numbers | bool = True, **changes: Numbers) -> When:
    """State the changes of an event, as in `when(self.h < 0.0, v=-self.e * self.v)`.

    `condition` is a relation between real numbers, or several joined by `&`, `|` and `~`; a real number counts as true
    above zero. The event happens when the condition becomes true, and again only after it was false. `changes` gives
    new values of discrete variables and of variables of the component, by name. They are computed from the values
    before the event. `check_units=False` is for numbers whose units do not agree, as in `eq`.
    """
    return When(condition, changes, _flag(check_units, "when"))


def at(time: Numbers, *, every: Numbers | None = None, check_units: Numbers | bool = True, **changes: Numbers) -> At:
    """State the changes of an event at a known time in s; steps end there.

    `time` is a number or an array, computed from parameters and discrete variables. With `every`, each event repeats
    after this interval. Events that were due before the start of a run happen at its start. Without `changes`, the
    times mark a change of the equations, such as the knots of a profile: `at(self.times)`. `check_units` is as in
    `when`.
    """
    return At(time, every, changes, _flag(check_units, "at"))


def refuse(condition: Truth | Numbers, reason: str, *, check_units: bool = True) -> Refuse:
    """State a condition under which a component cannot work: the run ends with an error that gives the reason.

    `check_units` is as in `when`.
    """
    return Refuse(condition, reason, _flag(check_units, "refuse"))


def impact(
    condition: Truth | Numbers,
    *,
    force: str,
    speed: Numbers,
    acceleration: Numbers,
    after: Numbers = 0.0,
    closed: Truth | Numbers = False,
    **changes: Numbers,
) -> Impact:
    r"""State the law of a unilateral contact, and an event at which an impulse acts on it.

    `force` names a discrete variable in N that is zero; the equations add it as a contact force that pushes. `speed` is
    the separation speed u at the contact, positive if it opens, such that force times speed is a power.
    `acceleration` is its rate. `after` is the least separation speed after an impact, such as -restitution u; it is at
    most -u, so that the impact gains no energy. When `condition` becomes true, the engine finds the impulses p of this
    contact, of all others whose condition becomes true at this instant, and of those that are `closed`, together:

    $$u^+ = u + W p, \qquad p_i \ge 0, \quad u_i^+ \ge \mathrm{after}_i, \quad p_i\,(u_i^+ - \mathrm{after}_i) = 0.$$

    $W_{ij}$ is the change of acceleration i with force j. All states change by the change of their rates with the
    forces, times p: speeds of the whole model jump, and positions do not. A closed contact transmits impulses, or
    separates. This is Newton's law of restitution with simultaneous contacts (Moreau 1988; Glocker, `Set-Valued Force
    Laws`, 2001). The rates hold for the values of all `yields` of the model, in which closed contacts and stuck
    friction let go. `changes` are those of `when`.
    """
    return Impact(condition, closed, speed, after, acceleration, changes, force)


def yields(**changes: Numbers) -> Yields:
    """State values that discrete variables have during an impulse, as in `yields(mode=FREE)`.

    A contact at rest, or friction that sticks, holds two sides together by an equation. An impulse exceeds every finite
    force, so friction lets go, and a contact takes part by its own `impact`.
    """
    return Yields(changes)


def follow(**changes: Numbers) -> Follow:
    """Keep discrete variables equal to values, by name: `follow(last=self.x)` makes `last` what Modelica calls pre(x).

    While an event iteration goes on, the variables still have the values of the round before, so that equations can
    compare the two: `(self.n > self.last_n)`. In each round in which no `ifelse` changes, if any value differs from its
    variable, all of them are set, together with the other events of the round. This ends when nothing differs.

    It causes no event by itself. A value that changes between events is taken over at the next event, just before it:
    the variable then is the left limit of the value. A value that is NaN is not taken over.
    """
    return Follow(changes)


def started(**changes: Numbers) -> Started:
    """State the changes of an event at the start of a run, after all other events there, but before clocks tick.

    `started(initial=0.0)` resets a discrete variable that is 1 at first: what Modelica calls initial(). Start values
    are searched for before this event. A run that continues another one does not start.
    """
    return Started(changes)


class Connection(NamedTuple):
    """Connected ports."""

    ports: tuple[Port, ...]


Connections: TypeAlias = tuple[Connection, ...]


def connect(*ports: Port) -> Connection:
    """Connect two or more ports of one kind: their across variables become equal, their flows sum to zero.

    Ports of arrays are connected member by member; a single port is connected with every member of an array.
    """
    return Connection(ports)


class Energy(NamedTuple):
    """The energy account of a component: power through its ports + `supplied` = d(stored)/dt + `dissipated`.

    `stored` in J is a function of the component's variables. `dissipated` (never negative) and `supplied` (by a source,
    from outside the model) are in W.
    """

    stored: Scalar = 0.0
    dissipated: Scalar = 0.0
    supplied: Scalar = 0.0


class EquationGroup(NamedTuple):
    """Equations between leaves of parts, stated once for all places where they hold.

    `form` is a component whose leaves stand for the leaves at a place, with a method `equations`, or
    `initial_equations`. A row of `leaves` holds, for one place, the number of each leaf among those of the component
    that states the group, in pytree order; `paths` holds the path of each place in it.
    """

    form: "Component"
    leaves: tuple[tuple[int, ...], ...]
    paths: tuple[str, ...]


class Component(Node, partial=True):
    """A part of a model: parameters, variables and ports, with the equations between them.

    A component states `equations`, or joins sub-components by `connections`, or both. A *partial* one (`class
    TwoPin(Component, partial=True)`) holds the common fields of several others and cannot be instantiated. All others
    are *final*: no class derives from them, except from one that only joins parts. Such a variant adds parts, declares
    others of the same names, and extends `super().connections()`.

    Some attributes serve models that are translated from other languages. `equation_groups` states equations between
    leaves of parts. `determined` maps the leaves of the component in pytree order to the same leaves, with those
    parameters and start values replaced that others determine: those with `determined_names`. `structural_names` are
    parameters of the original model on which its structure may depend: they are no leaves. `declared_in` are the places
    in a text that declare variables, by their paths, for messages.

    `nominal` sets the nominal sizes of variables for which the default of the unit does not fit, as in
    `Capacitor(C=1e-9, nominal=dict(v=1e-5))`: see `sized`. `if_singular` explains a singularity of the component's
    equations during a run and names the remedy. `elsewhere` maps names of other libraries to those here, as in
    `{"freqHz": "frequency"}`, for error messages. `mode_names` names the values of discrete variables for plots, as in
    `{"mode": {-1.0: "at the lower stop", 0.0: "free", 1.0: "at the upper stop"}}`.
    """

    if_singular: ClassVar[str] = ""
    elsewhere: ClassVar[Mapping[str, str]] = {}
    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {}
    equation_groups: ClassVar[tuple[EquationGroup, ...]] = ()
    determined: ClassVar[Callable[[Sequence[Any]], Sequence[Any]] | None] = None
    determined_names: ClassVar[frozenset[str]] = frozenset()
    structural_names: ClassVar[frozenset[str]] = frozenset()
    declared_in: ClassVar[Mapping[str, str]] = {}
    nominal: Mapping[str, object] = eqx.field(
        static=True, kw_only=True, default=Sizes(), converter=as_sizes, repr=False
    )
    _past: Past | None = eqx.field(init=False, default=None, repr=False, metadata={"is_past": True})

    def __check_init__(self) -> None:
        if sizes := sizes_of(self):
            object.__setattr__(self, "nominal", checked_sizes(self, sizes))
        object.__setattr__(self, "_past", None)

    @classmethod
    def _is_composite(cls) -> bool:
        laws = ("equations", "initial_equations", "events", "energy", "shared_equations", "shared_energy")
        is_plain = all(getattr(cls, name) is getattr(Component, name) for name in laws)
        return is_plain and not cls.equation_groups and cls.determined is None

    def __str__(self) -> str:
        """The parts as a tree, with values in their units."""
        return as_text(branch(self))

    def _repr_html_(self) -> str:
        """The same for a notebook, where parts fold, with the documentation of the class."""
        return as_html(branch(self)) + folded(type(self).__name__, class_html(type(self)))

    def equations(self, d: Any) -> Equations:
        """The equations by name. `d` has the shape of `self` and holds the time derivatives of its variables."""
        return {}

    def initial_equations(self, d: Any) -> Equations:
        """The equations by name, between variables and their derivatives, that hold at the start only.

        They determine the start values that are not given, first those of the component itself.
        """
        return {}

    def connections(self) -> Connections:
        """The connections among the ports of this component and of its parts."""
        return ()

    def events(self) -> Events:
        """The events by name, as functions of the component's variables. Events with a leading underscore do not appear
        in the log of a run.
        """
        return {}

    def energy(self) -> Energy | None:
        """The energy account as a function of the component's variables; None if it stores and dissipates nothing."""
        return None

    def shared_equations(self, d: Any) -> Equations:
        """Equations that a base class adds to the `equations` of all its classes."""
        return {}

    def shared_energy(self, own: Energy) -> Energy:
        """What a base class makes of the account `own`, which `energy` of one of its classes states."""
        return own

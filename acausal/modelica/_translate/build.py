"""From a flat model to a component."""

from collections.abc import Iterable, Iterator

from ..._declare.node import leaves_of
from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatEquation, FlatModelica, FlatVariable
from .._syntax.visits import nodes
from .equation_groups import EquationGroups
from .guesses import propagate
from .known import names_in
from .leaves import ModelLeaf
from .model import ModelicaModel
from .model_events import ModelEvents
from .model_leaves import ModelLeaves
from .new_variables import hold_integers, make_delays, name_rates
from .start_values import StartValues
from .translation import INITIAL, Translation
from .tree import attribute_path, tree


def component(flat: FlatModelica) -> ModelicaModel:
    """The component of a flat model.

    Raises `ModelError` for what is not supported, with its place in the model.
    """
    model = Translation.of(flat)
    starts = StartValues(model)
    ModelLeaves(model, starts).make()
    delays = make_delays(model)
    name_rates(model)
    hold_integers(model)
    groups = _groups(model, starts)
    events = ModelEvents(model, delays)
    starts.state_previous()
    _drop_unused(model, groups)
    has_events = bool(events) or INITIAL in groups.used()
    if not has_events:
        del model.leaves[INITIAL]
    by_path = {leaf.path: leaf for leaf in model.leaves.values()}
    propagate(groups.groups.values(), by_path, model.known.library)
    namespace = {"events": events.method()} if has_events else {}
    leaves = model.all_leaves()
    _check_names(leaves)
    root = tree(leaves, model.connectors.ports, ModelicaModel, _class_name(flat.name), namespace, flat.classes)
    places = {leaf.path: i for i, leaf in enumerate(leaves_of(root))}
    cls = type(root)
    cls.equation_groups = groups.stated(places)
    if determine := model.determined.function(places):
        cls.determined = staticmethod(determine)
    cls.determined_names = model.determined.names()
    cls.structural_names = frozenset(map(attribute_path, model.known.parameters()))
    connected = set(_connected(flat))
    cls.declared_in = {
        attribute_path(leaf.path): _place(leaf.variable, is_connected=leaf.variable.name in connected)
        for leaf in model.leaves.values()
        if leaf.variable is not None and leaf.variable.place is not None
    }
    cls.flat, cls.experiment = flat, flat.experiment
    return root


def _check_names(leaves: Iterable[ModelLeaf]) -> None:
    """Raises `ModelError` for two variables with one name as attributes, such as `a` and `'a'`."""
    found: dict[str, ModelLeaf] = {}
    for leaf in leaves:
        other = found.setdefault(attribute_path(leaf.path), leaf)
        if other is not leaf:
            place = "" if leaf.variable is None or leaf.variable.place is None else f"{leaf.variable.place}: "
            raise ModelError(
                f"{place}{other.path} and {leaf.path} would both be the attribute {attribute_path(leaf.path)}. "
                "Remedy: another name for one of them."
            )


def _connected(flat: FlatModelica) -> Iterator[str]:
    """The variables in equations of connections."""
    for equation in flat.equations:
        if equation.origin == "connection":
            yield from (x.name for x in nodes(equation.residual) if isinstance(x, e.Ref))


def _place(variable: FlatVariable, *, is_connected: bool) -> str:
    """The place of a variable in the text, and whether it is an input that nothing determines."""
    is_open = variable.causality == "input" and variable.binding is None and not is_connected
    return f"an input without a connection, {variable.place}" if is_open else str(variable.place)


def _groups(model: Translation, starts: StartValues) -> EquationGroups:
    groups = EquationGroups(model)
    between: list[FlatEquation] = []
    for equation in model.equations:
        if _joins_expandable(model, equation):
            between.append(equation)
        else:
            groups.add(equation, is_initial=False)
    for equation in model.lowered.initial_equations:
        if not starts.takes(equation):
            groups.add(equation, is_initial=True)
    for algorithm in model.lowered.algorithms:
        groups.add_algorithm(algorithm)
    _add_used(groups, between)
    return groups


def _joins_expandable(model: Translation, equation: FlatEquation) -> bool:
    """Whether an equation connects members of expandable connectors with each other only."""
    if equation.origin != "connection":
        return False
    variables = [model.flat.variables.get(name) for name in names_in(equation.residual)]
    return all(variable is not None and variable.is_expandable for variable in variables)  # None for a record


def _add_used(groups: EquationGroups, between: Iterable[FlatEquation]) -> None:
    """Adds the equations between members of expandable connectors, if others read a member of the connection set."""
    used, waiting = groups.used(), list(between)
    while found := [equation for equation in waiting if not used.isdisjoint(names_in(equation.residual))]:
        waiting = [equation for equation in waiting if used.isdisjoint(names_in(equation.residual))]
        for equation in found:
            groups.add(equation, is_initial=False)
            used.update(names_in(equation.residual))


def _drop_unused(model: Translation, groups: EquationGroups) -> None:
    """Members of expandable connectors that nothing uses do not exist."""
    used = groups.used()
    for variable in model.flat.variables.values():
        if variable.is_expandable and variable.name not in used:
            model.leaves.pop(variable.name, None)


def _class_name(name: str) -> str:
    last = name.partition("(")[0].strip().rpartition(".")[2]
    return last if last.isidentifier() else "Model"

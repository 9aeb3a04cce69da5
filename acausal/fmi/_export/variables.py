"""The variables of an FMU: what it calls them, and where the C code keeps them."""

import collections
import dataclasses
from collections.abc import Sequence
from typing import Literal

from ..._errors import ModelError
from ..._evaluate.program import Use
from ..._reduce.incidence import Pair
from ..._units.dimension import TIME
from ..._units.parsing import parsed
from ...codegen.layout import Quantity
from ...codegen.model import CModel, Output

Causality = Literal["independent", "parameter", "input", "output", "local"]
Space = str  # "t": the time, "x" states, "p" parameters, "d" discrete, "v" values, "z" event indicators, "0" zero


@dataclasses.dataclass(frozen=True)
class FmuVariable:
    """A variable. `derivative_of` is the value reference of the state whose rate it is."""

    name: str
    causality: Causality
    variability: str
    unit: str
    space: Space
    place: int
    sign: int = 1
    start: float | None = None
    derivative_of: int | None = None
    minimum: float | None = None


@dataclasses.dataclass(frozen=True)
class Variables:
    """All variables, each with its value reference as its position, and the positions of some kinds."""

    all: list[FmuVariable]
    states: list[int]
    rates: list[int]
    outputs: list[int]
    indicators: list[int]
    state_places: list[int]  # of the FMU's states in the state vector of the C code, which holds the inputs, too
    input_places: list[int]


def variables_of(model: CModel, inputs: Sequence[str], sources: Sequence[str], n_indicators: int) -> Variables:
    """The variables of an exported model. `sources` are the paths that hold the values of the inputs."""
    held = _input_places(model, inputs, sources)
    names = {place: output.name for output in model.outputs if (place := _state_place(model, output)) is not None}
    discrete = {output.name for output in model.outputs if output.places.space == "d"}
    found = [FmuVariable("time", "independent", "continuous", "s", "t", 0)]
    states, rates, places = [], [], []
    for name, unit, place, value in _elements(model.states):
        if place in held:
            continue
        is_output = place in names and names[place] == name
        states.append(len(found))
        places.append(place)
        causality = "output" if is_output else "local"
        found.append(FmuVariable(name, causality, "continuous", unit, "x", place, start=value))
    for state, place in zip(list(states), places, strict=True):
        own = found[state]
        unit = _per_second(own.unit)
        rates.append(len(found))
        where = int(model.rate_places[place])
        found.append(FmuVariable(f"der({own.name})", "local", "continuous", unit, "v", where, derivative_of=state))
    starts = {place: value for _, _, place, value in _elements(model.states)}
    for name, (place, sign) in zip(inputs, held.items(), strict=True):
        found.append(FmuVariable(name, "input", "continuous", "", "x", place, sign, start=sign * starts[place]))
    positive = _positive(model)
    for name, unit, place, value in _elements(model.parameters):
        minimum = 0.0 if place in positive else None
        found.append(FmuVariable(name, "parameter", "tunable", unit, "p", place, start=value, minimum=minimum))
    for name, unit, place, value in _elements(model.discrete):
        causality = "output" if name in discrete else "local"
        found.append(FmuVariable(name, causality, "discrete", unit, "d", place, start=value))
    outputs = [i for i, own in enumerate(found) if own.causality == "output"]
    shown = {found[i].name for i in outputs}
    for output in model.outputs:
        if output.name in shown:
            continue
        space = output.places.space or "0"
        outputs.append(len(found))
        first, sign = int(output.places.firsts[0]), output.places.sign
        found.append(FmuVariable(output.name, "output", "continuous", output.unit, space, first, sign))
    indicators = list(range(len(found), len(found) + n_indicators))
    found += [FmuVariable(f"event_indicator[{i}]", "local", "continuous", "", "z", i) for i in range(n_indicators)]
    _check_names(found)
    return Variables(found, states, rates, outputs, indicators, places, list(held))


def _per_second(unit: str) -> str:
    """The unit of a rate."""
    if not unit:
        return ""
    if unit.endswith("/s"):
        return f"{unit}2"
    return str(parsed(unit).dimension / TIME) if "/" in unit else f"{unit}/s"


def _elements(quantities: Sequence[Quantity]) -> list[tuple[str, str, int, float]]:
    """Name, unit, place and value of each element; an array has one for each."""
    found = []
    for quantity in quantities:
        for i, value in enumerate(quantity.value.tolist()):
            name = quantity.name if quantity.size == 1 else f"{quantity.name}[{i}]"
            found.append((name, quantity.unit, quantity.place + i, float(value)))
    return found


def _input_places(model: CModel, inputs: Sequence[str], sources: Sequence[str]) -> dict[int, int]:
    """The place of each input in the state vector, with the sign of the state.

    Raises `ModelError` if an input is no state of its own, or if equations need its derivative.
    """
    system, found = model.system, {}
    nodes = {leaf.path: leaf.first for leaf in system.flat.own_leaves if leaf.declaration.is_variable}
    starts = dict(zip(system.states, system.plan.starts.tolist(), strict=False))
    uses = [use for group in system.plan.groups for use in group.uses]
    for name, source in zip(inputs, sources, strict=True):
        pair, sign = system.pair_of_node(nodes[source])
        if pair is None or pair not in starts or any(_needs_rate(use, pair) for use in uses):
            raise ModelError(
                f"{name} cannot be an input of an FMU: the equations need its derivative, or determine it. Remedy: "
                "drive a force, a torque or a current, or put a filter such as FirstOrder behind the input."
            )
        found[starts[pair]] = sign
    return found


def _needs_rate(use: Use, pair: Pair) -> bool:
    """Whether a block reads the derivative of an input, or determines it together with other unknowns."""
    rate = pair[0], 1
    return rate in use.values or (rate in use.gives and len(use.gives) > 1)


def _positive(model: CModel) -> set[int]:
    """The places of parameters that cannot be negative."""
    found: set[int] = set()
    for leaf, start in model.layout.params.items():
        sign = model.system.flat.leaves[leaf].declaration.sign
        if sign is not None and sign.name in ("positive", "nonnegative"):
            found |= set(range(start, start + model.layout.size(leaf)))
    return found


def _state_place(model: CModel, output: Output) -> int | None:
    """The place of a state that an output shows; None for other values."""
    places = output.places
    is_state = places.space == "v" and places.sign == 1 and int(places.firsts[0]) < model.n_states
    return int(places.firsts[0]) if is_state else None


def _check_names(variables: Sequence[FmuVariable]) -> None:
    counts = collections.Counter(variable.name for variable in variables)
    if several := [name for name, count in counts.items() if count > 1]:
        raise ModelError(f"An FMU has one variable of each name, but the model has several of {', '.join(several)}.")

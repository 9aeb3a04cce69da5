"""Properties of every component of the library: accepted values, errors for others, copies."""

import copy
import dataclasses
import inspect
import pickle
import re
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _library import LIBRARY

from acausal import ArgumentError, Component, ParameterError, UnknownNameError, check, parameters, replace
from acausal._declare.layout import complete_leaves, rebuilt
from acausal._declare.node import Node, leaves_of, nodes_of
from acausal._declare.node_requirements import broken
from acausal._evaluate.groups import ModelParameters, slot_values
from acausal._evaluate.intake import ModelRequirements
from acausal._indices import joined
from acausal._interpret.in_parts import in_parts
from acausal._reduce.flatten import flatten

NO_NUMBERS = (None, "a", 1j, {}, [1.0, "a"])
every_component = pytest.mark.parametrize("component", LIBRARY, ids=lambda component: type(component).__name__)


def with_values(component: Component, values: dict[str, Any]) -> Component:
    """The component with other parameters by path, without the checks of `replace`."""
    return rebuilt(component, lambda path, declaration, value: values.get(path, value))


@every_component
def test_what_is_no_number_is_refused(component: Component) -> None:
    for path in parameters(component):
        for value in NO_NUMBERS:
            with pytest.raises(ParameterError) as caught:
                replace(component, {path: value})
            kind = ", with a unit as in '15 mm' or without" if isinstance(value, str) else " or an array of them"
            assert str(caught.value) == f"{path} must be a real number{kind}, got {value!r}."


@every_component
def test_constructors_refuse_what_is_no_number(component: Component) -> None:
    """For every node whose parameters are arguments of its constructor."""
    for _, node in nodes_of(component):
        for name in [name for name in _own_parameters(node) if name in _arguments(node)]:
            declared = "|".join(cls.__name__ for cls in type(node).__mro__)
            with pytest.raises(ParameterError, match=rf"^({declared})\.{name} must be a real number"):
                type(node)(**(_arguments(node) | {name: "a"}))


def _own_parameters(node: Any) -> list[str]:
    return [leaf.path for leaf in leaves_of(node) if leaf.declaration.role == "param" and "." not in leaf.path]


def _arguments(node: Any) -> dict[str, Any]:
    """Arguments that rebuild a node; none if its constructor takes other arguments than its fields."""
    taken = list(inspect.signature(type(node).__init__).parameters)[1:]
    fields = {field.name: getattr(node, field.name) for field in dataclasses.fields(node)}
    return {name: fields[name] for name in taken} if set(taken) <= set(fields) else {}


@every_component
def test_what_is_not_finite_is_refused(component: Component) -> None:
    """Infinity is allowed if the class declares it, for example as the absence of a limit."""
    declared = {leaf.path: leaf.declaration for leaf in leaves_of(component)}
    for bad in (np.nan, np.inf, -np.inf):
        changed = {path: np.full(np.shape(value), bad) for path, value in parameters(component).items()}
        found = check(with_values(component, changed)).problems
        for path in changed:
            declaration = declared[path]
            is_admitted = bad == np.inf and declaration.is_unbounded
            is_admitted |= bad == -np.inf and declaration.is_unbounded and declaration.sign is None
            text = f"{path} must be {declaration.range}, got"
            assert is_admitted != any(text in problem for problem in found)
            if not is_admitted:
                with pytest.raises(ParameterError, match=re.escape(text)):
                    replace(component, {path: changed[path]})


@every_component
def test_arrays_in_place_of_one_number_are_refused(component: Component) -> None:
    paths = [leaf.path for leaf in leaves_of(component) if leaf.declaration.role == "param" and leaf.sizes == ()]
    found = check(with_values(component, dict.fromkeys(paths, np.ones(3)))).problems
    for path in paths:
        assert any(f"{path} has shape (3,), but is declared with shape ()" in problem for problem in found)


@every_component
def test_arrays_of_other_shapes_are_refused(component: Component) -> None:
    for leaf in leaves_of(component):
        if leaf.declaration.role == "param" and leaf.sizes is None:
            for other in (1.0, np.ones((2, 1, 3))):
                assert check(with_values(component, {leaf.path: np.asarray(other)})).problems


@every_component
def test_numbers_of_every_kind_become_doubles(component: Component) -> None:
    for path, value in parameters(component).items():
        for kind in (np.float32, np.int64, jnp.float32):
            wanted = np.round(value).astype(kind)
            try:
                found = parameters(replace(component, {path: jnp.asarray(wanted)}))[path]
            except ParameterError:  # the rounded number is out of range
                continue
            assert found.dtype == np.float64
            np.testing.assert_array_equal(found, wanted.astype(float))


@every_component
def test_names_that_do_not_exist(component: Component) -> None:
    name = type(component).__name__
    with pytest.raises(UnknownNameError, match=f"^{name} has no port, part, parameter or variable 'wrong'"):
        _ = component.wrong  # pyright: ignore[reportAttributeAccessIssue]
    assert not hasattr(component, "wrong")
    with pytest.raises(ArgumentError, match=f"^{name} takes no argument 'wrong'"):
        type(component)(wrong=1.0)  # pyright: ignore[reportCallIssue]


@every_component
def test_copies(component: Component) -> None:
    for same in (copy.deepcopy(component), pickle.loads(pickle.dumps(component))):
        assert jax.tree_util.tree_structure(same) == jax.tree_util.tree_structure(component)
        for one, other in zip(*(jax.tree_util.tree_leaves(tree) for tree in (same, component)), strict=True):
            np.testing.assert_array_equal(one, other)


@every_component
def test_requirements_are_the_same_for_numbers_and_traced(
    component: Component, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For random parameters, a system finds the same errors as its components, except those of start values."""
    monkeypatch.setattr(Node, "_states_start_requirements", classmethod(lambda cls: False))
    flat = flatten(component)
    requirements, draw = ModelRequirements(flat), np.random.default_rng(0)
    keys = requirements.keys

    @in_parts
    def is_broken(leaves: list[Any]) -> Any:
        slots = {key: slot_values(flat, dict(enumerate(leaves)), *key) for key in keys}
        return joined(requirements.broken(ModelParameters(slots)))

    for _ in range(20):
        values = {
            path: value * draw.choice([-1.0, 0.0, 0.2, 1.0, 3.0, np.nan, np.inf], p=[0.1, 0.1, 0.1, 0.4, 0.1, 0.1, 0.1])
            for path, value in parameters(component).items()
        }
        changed = with_values(component, values)
        mask = np.asarray(is_broken([0.0 if leaf is None else leaf for leaf in complete_leaves(changed)[0]]))
        found = [(path, text) for path, node in nodes_of(changed) for text in broken(node)]
        said = sorted(sentence for sentence, is_bad in zip(requirements.sentences, mask, strict=True) if is_bad)
        alone = sorted(f"{path}.{text}".lstrip(".").split(", got ")[0].rstrip(".") for path, text in found)
        assert said == alone

"""Classes that users receive have public names, and the engine's own classes have none."""

# pyright: reportUnnecessaryTypeIgnoreComment=true

import ast
import inspect
import typing
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, assert_type

import pytest
from _models import RC, rc

import acausal
import acausal.design
from acausal import AcausalError, ArgumentError, Component, ParameterError, Scalar, Solution, simulate
from acausal.design import Choice, Course, Design, Experiment, Fit, Front, choose, control, identify, optimise, pareto
from components.electrical import DCMotor, Resistor

PUBLIC = {name: item for name, item in vars(acausal).items() if not name.startswith("_")}
OF_DESIGN = {name: item for name, item in vars(acausal.design).items() if not name.startswith("_")}
CLASSES = [item for item in PUBLIC.values() if inspect.isclass(item) and item.__module__.startswith("acausal")]
FUNCTIONS = [item for item in PUBLIC.values() if inspect.isfunction(item) and item.__module__.startswith("acausal")]


def hints(item: Any) -> dict[str, Any]:
    """The annotations of a function or of the fields of a class."""
    try:
        return typing.get_type_hints(item)
    except NameError:  # an import for type checkers alone
        return {}


def returned(function: Any) -> Iterator[type]:
    """The classes of the library in the annotation of what a function returns."""
    return named(hints(function).get("return"))


def named(hint: Any) -> Iterator[type]:
    """The classes of the library in an annotation."""
    todo = [hint]
    while todo:
        item = todo.pop()
        todo += typing.get_args(item)
        item = typing.get_origin(item) or item
        if inspect.isclass(item) and item.__module__.startswith("acausal."):
            yield item


def members(cls: type) -> Iterator[Any]:
    """The public methods and properties that a class itself states."""
    for name, item in vars(cls).items():
        if not name.startswith("_"):
            item = item.fget if isinstance(item, property) else getattr(item, "__func__", item)
            if inspect.isfunction(item):
                yield item


# What stands in declarations, equations, events and connections is named by what holds it, such as `Events`.
TERMS = {
    *("Equation", "Connection", "Requirement", "Shape"),
    *("When", "Passing", "At", "Kink", "Refuse", "Impact", "Yields", "Follow", "Started", "Remember"),
}


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.__name__)
def test_what_functions_return_has_a_public_name(function: Any) -> None:
    missing = {cls.__name__ for cls in returned(function)} - PUBLIC.keys() - TERMS
    assert not missing


@pytest.mark.parametrize("cls", [cls for cls in CLASSES if cls is not acausal.System], ids=lambda cls: cls.__name__)
def test_what_methods_return_has_a_public_name(cls: type) -> None:
    missing = {found.__name__ for member in members(cls) for found in returned(member)} - PUBLIC.keys() - TERMS
    assert not missing


def test_what_results_of_designs_hold_has_a_public_name() -> None:
    classes = [item for item in OF_DESIGN.values() if inspect.isclass(item)]
    functions = [item for item in OF_DESIGN.values() if inspect.isfunction(item)]
    functions += [member for cls in classes for member in members(cls)]
    held = [hint for cls in classes for name, hint in hints(cls).items() if not name.startswith("_")]
    found = [cls for hint in held for cls in named(hint)] + [cls for f in functions for cls in returned(f)]
    assert len(found) > 50
    assert not {cls.__name__ for cls in found} - PUBLIC.keys() - OF_DESIGN.keys()


def test_errors_have_one_base() -> None:
    errors = [cls for cls in CLASSES if issubclass(cls, Exception) and not issubclass(cls, Warning)]
    assert len(errors) > 6
    assert all(issubclass(cls, AcausalError) for cls in errors)


@pytest.mark.thorough
def test_what_editors_see() -> None:
    """Checked by the type checker: a solution knows the class of its model, and a condition that of its argument."""
    solution = simulate(rc(), 1.0, until=lambda s: assert_type(s, RC).c.v - 0.5, save="end", throw=False)
    assert_type(solution, Solution[RC])
    assert_type(solution.final, RC)
    assert_type(solution.values, RC)
    assert isinstance(solution.final, RC)
    assert_type(Resistor(R=1.0), Resistor)
    assert_type(solution.final.c.v, Scalar)
    assert_type(DCMotor(R=1.0, k=1.0, J=1.0).rotor.w, Scalar)


def what_editors_see_of_designs(motor: DCMotor, run: Callable[[Any], Any], experiment: Experiment) -> None:
    """Checked by the type checker alone: what is found knows the class of the model, whatever the run returns."""
    assert_type(identify(motor, {}, experiment), Fit[DCMotor])
    assert_type(identify(motor, {}, [experiment]).model, DCMotor)
    general: Fit[Component] = identify(motor, {}, experiment)
    assert_type(general.model, DCMotor)
    assert_type(Experiment.of_run([1.0], {"power": [2.0]}, outputs={"power": lambda s: s.rotor.w}), Experiment)
    assert_type(optimise(motor, {}, len, run=run), Design[DCMotor])
    assert_type(optimise(motor, {}, lambda s: s.t1, run=lambda m: simulate(m, 1.0)).model, DCMotor)
    assert_type(pareto(motor, {}, {}, run=run), Front[DCMotor])
    assert_type(control(motor, {}, duration=1.0), Course[DCMotor])
    assert_type(choose(motor, {}, len), Choice[DCMotor])
    assert_type(choose({"slow": motor}, {}, len).model(0), DCMotor)
    assert_type(choose(motor, {}, len).continuous("R"), Design[DCMotor])


def test_type_checkers_know_what_constructors_take() -> None:
    """Each remark below for the type checker is itself an error where there is nothing to ignore."""
    with pytest.raises(ArgumentError):
        Resistor()  # pyright: ignore[reportCallIssue]
    with pytest.raises(ArgumentError):
        Resistor(R=1.0, r=1.0)  # pyright: ignore[reportCallIssue]
    with pytest.raises(ParameterError):
        Resistor(R="one")  # pyright: ignore[reportArgumentType]


def class_names(folder: Path, *, without: Path | None = None) -> list[str]:
    """The names of the classes in a folder, except internal ones of modules."""
    return [
        node.name
        for file in folder.rglob("*.py")
        if without not in file.parents
        for node in ast.parse(file.read_text()).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]


def test_the_name_of_a_class_means_one_thing() -> None:
    """In the engine and in design, for public and internal classes; and in the front end of Modelica models, whose
    syntax tree has the words of the specification of the language.
    """
    engine = Path(acausal.__file__).parent
    language = engine / "modelica" / "_frontend"
    for names in (class_names(engine, without=language), class_names(language)):
        assert not [name for name, n in Counter(names).items() if n > 1]

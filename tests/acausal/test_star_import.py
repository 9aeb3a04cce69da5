"""Public names: documented, unique across the packages, and safe to import by a star."""

import builtins
import importlib
import inspect
import pkgutil
import pydoc
import re
from collections.abc import Iterator
from typing import Any

import pytest

import acausal
import acausal.design
import acausal.testing
import components

LIBRARIES = [acausal, acausal.design, acausal.testing]
PACKAGES = [item.name for item in pkgutil.iter_modules(components.__path__, "components.") if item.ispkg]
# Variables and functions of scripts, and what they import by name from the standard library, numpy and jax.
COMMON = """
about array Array at axes check compare copy data debug diagram dot figure grad hessian jit load log main mean model
name parameters plot pi repeat replace reshape save shape show size solve stack structure sum test
time units values vmap where zeros
""".split()


def listed(text: str) -> list[str]:
    """The names in the overview of a docstring: the words of its indented lines that stand before two spaces."""
    entries = re.findall(r"^    (\w.*?)(?:  .*| Solvers\.)?$", text, re.MULTILINE)
    return [name for entry in entries for name in re.findall(r"\w+\*?", entry)]


def test_the_overview_lists_every_public_name() -> None:
    """Names that a star import leaves out are marked."""
    entries = listed(acausal.__doc__ or "")
    names = {name for name, item in vars(acausal).items() if name[0] != "_" and not inspect.ismodule(item)}
    assert len(entries) == len(set(entries))
    assert set(entries) == set(acausal.__all__) | {f"{name}*" for name in names - set(acausal.__all__)}


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda library: library.__name__)
def test_public_names_are_documented(library: Any) -> None:
    """By a text of their own, if they are classes or functions of the library."""
    for name in library.__all__:
        item = getattr(library, name)
        if isinstance(item, type) or inspect.isfunction(item):
            assert vars(item).get("__doc__") or inspect.getdoc(item), name
        for method, text in members(item) if isinstance(item, type) else ():
            assert text, f"{name}.{method}"


def members(cls: Any) -> Iterator[tuple[str, str | None]]:
    """The public methods and properties of a class that the library defines, each with its docstring."""
    bases = [base for base in cls.__mro__ if base.__module__.partition(".")[0] == "acausal"]
    for name in sorted({name for base in bases for name in vars(base) if name[0] != "_" or name == "__call__"}):
        item = inspect.getattr_static(cls, name)
        function = getattr(item, "fget", None) or getattr(item, "func", None) or getattr(cls, name)
        if inspect.isroutine(function) and str(function.__module__).partition(".")[0] == "acausal":
            yield name, function.__doc__


def test_help_names_the_functions() -> None:
    text = pydoc.plain(pydoc.render_doc(acausal))
    assert "simulate         Integrate a model over time" in text
    assert "\n    simulate(model: " in text
    assert "enable_double_precision" not in text
    assert "class Array" not in text  # jax's, behind `Vector`, would take more room than all of ours


def test_a_name_stands_for_one_thing() -> None:
    names = [name for library in LIBRARIES for name in library.__all__]
    assert len(names) == len(set(names)) > 100


@pytest.mark.parametrize("name", [*(library.__name__ for library in LIBRARIES), *PACKAGES])
def test_a_star_import_shadows_no_common_name(name: str) -> None:
    library = importlib.import_module(name)
    assert library.__all__
    assert not set(library.__all__) & {*dir(builtins), *COMMON}
    scope: dict[str, Any] = {}
    exec(f"from {name} import *", scope)
    assert scope.keys() - {"__builtins__"} == set(library.__all__)

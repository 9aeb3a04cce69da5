"""The rooms of `acausal.design`: imports between them go one way, and no module imports another in a circle."""

import ast
import graphlib
from collections.abc import Iterator
from pathlib import Path

import acausal.design

ROOT = Path(acausal.design.__file__).parent
# Each room knows those before it.
ROOMS = (
    "_problem",
    "_certificate",
    "_compute",
    "_sensitivity",
    "_optimise",
    "_identify",
    "_control",
    "_sweep",
    "_choose",
    "_tolerance",
)
MODULES = sorted(path.relative_to(ROOT).with_suffix("") for path in ROOT.glob("*/*.py"))


def imports(module: Path) -> Iterator[tuple[str, str, bool]]:
    """Room and name of each module of `acausal.design` that a module imports, and whether a function does so."""
    todo = [(node, False) for node in ast.parse((ROOT / module).with_suffix(".py").read_text()).body]
    while todo:
        node, is_late = todo.pop()
        if isinstance(node, ast.ImportFrom) and node.level in (1, 2):
            room, _, name = ((node.module or "") if node.level == 2 else f"{module.parent}.{node.module}").partition(
                "."
            )
            yield room, name, is_late
        is_function = isinstance(node, ast.FunctionDef | ast.Lambda)
        todo += [(child, is_late or is_function) for child in ast.iter_child_nodes(node)]


def test_every_module_is_in_a_room() -> None:
    assert {module.parent.name for module in MODULES} == set(ROOMS)
    assert [path.name for path in ROOT.glob("*.py")] == ["__init__.py"]


def test_a_room_imports_only_from_those_before_it() -> None:
    for module in MODULES:
        own = ROOMS.index(module.parent.name)
        later = [f"{room}.{name}" for room, name, _ in imports(module) if ROOMS.index(room) > own]
        assert not later, f"{module} imports {', '.join(later)}"


def test_no_module_imports_another_in_a_circle() -> None:
    """Imports for type checkers count. A picture knows what it draws, so the method that draws imports it late."""
    graph = {
        f"{module.parent}.{module.name}": {f"{room}.{name}" for room, name, is_late in imports(module) if not is_late}
        for module in MODULES
    }
    tuple(graphlib.TopologicalSorter(graph).static_order())


def test_only_pictures_are_imported_late() -> None:
    for module in MODULES:
        for room, name, is_late in imports(module):
            assert is_late == (name == "plots"), f"{module} imports {room}.{name}"

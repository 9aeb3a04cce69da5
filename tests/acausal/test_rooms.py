"""The rooms of the library: each knows only those before it, and no module imports another in a circle."""

import ast
import graphlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import acausal

ROOT = Path(acausal.__file__).parent
ROOMS = {
    "acausal": (
        *("_units", "_declare", "_reduce", "_unit_check", "_interpret", "_evaluate", "_integrate", "_analyse", "_show"),
        *("codegen", "fmi", "testing", "design", "modelica"),
    ),
    "acausal._integrate": ("solvers", "setup", "programs", "step", "events", "loop", "start", "results"),
    "acausal.design": (
        *("_problem", "_certificate", "_compute", "_sensitivity", "_optimise"),
        *("_identify", "_control", "_sweep", "_choose", "_tolerance", "_train", "_explore"),
    ),
}
MODULES = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(ROOT.rglob("*.py"))
}


def imports(module: str) -> Iterator[tuple[str, bool]]:
    """The modules of the library that a module imports, and whether a function does so; not those for types alone."""
    path = MODULES[module]
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    todo: list[tuple[ast.AST, bool]] = [(node, False) for node in ast.parse(path.read_text()).body]
    while todo:
        node, is_late = todo.pop()
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.ImportFrom) and node.level:
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            base = ".".join([*above, *([node.module] if node.module else [])])
            named = {f"{base}.{alias.name}" for alias in node.names} & set(MODULES)
            yield from ((name, is_late) for name in named or {base})
        is_function = isinstance(node, ast.FunctionDef | ast.Lambda)
        todo += [(child, is_late or is_function) for child in ast.iter_child_nodes(node)]


def room_of(module: str, house: str) -> int:
    """The place of its room in the order; -1 for modules beside the rooms."""
    first = module.removeprefix(f"{house}.").partition(".")[0]
    return ROOMS[house].index(first) if module.startswith(f"{house}.") and first in ROOMS[house] else -1


@pytest.mark.parametrize("house", ROOMS)
def test_a_room_imports_only_from_those_before_it(house: str) -> None:
    folders = {path.name for path in MODULES[house].parent.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders == set(ROOMS[house])
    pairs = [(module, other) for module in MODULES if room_of(module, house) >= 0 for other, _ in imports(module)]
    assert not [pair for pair in pairs if room_of(pair[1], house) > room_of(pair[0], house)]


@pytest.mark.thorough
def test_no_module_imports_another_in_a_circle() -> None:
    graph = {module: {other for other, is_late in imports(module) if not is_late} for module in MODULES}
    tuple(graphlib.TopologicalSorter(graph).static_order())


def test_the_engine_imports_only_ports_of_components() -> None:
    """Where FMUs and Modelica models become components that are to be connected."""
    found = set[tuple[str, str]]()
    for module, path in MODULES.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "components":
                found.update((room, alias.name) for room in [module.split(".")[1]] for alias in node.names)
            assert not isinstance(node, ast.Import) or all("components" not in alias.name for alias in node.names)
    assert {room for room, _ in found} == {"fmi", "modelica"}
    assert {name for _, name in found} == {"Input", "Output", "Pin", "Flange", "HeatPort"}


def test_the_rooms_of_a_run_do_not_know_what_runs_them() -> None:
    drivers = {f"acausal._integrate.{name}" for name in ("run", "stored_run", "simulate")}
    inside = [module for module in MODULES if room_of(module, "acausal._integrate") >= 0]
    assert not [(module, other) for module in inside for other, _ in imports(module) if other in drivers]


def test_designs_import_their_pictures_late() -> None:
    """Pictures know what they draw, so the methods that draw import them."""
    for module in MODULES:
        for other, is_late in imports(module) if module.startswith("acausal.design.") else ():
            if other.startswith("acausal.design."):
                assert is_late == other.endswith("_plots"), f"{module} imports {other}"

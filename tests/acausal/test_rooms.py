"""The rooms of the engine: each knows only those before it."""

import ast
from pathlib import Path

import acausal

ROOT = Path(acausal.__file__).parent
ORDER = (
    "_units",
    "_declare",
    "_reduce",
    "_unit_check",
    "_evaluate",
    "_integrate",
    "_analyse",
    "_show",
    "testing",
    "design",
)


def _imported(path: Path) -> set[str]:
    """The rooms that a file imports from, within functions too; what is imported for types alone does not count."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            node.body = []
    found = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level)
    return {(node.module or "").partition(".")[0] for node in found if node.level == len(path.relative_to(ROOT).parts)}


def test_no_room_imports_from_one_behind_it() -> None:
    rooms = {path.name for path in ROOT.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert rooms == set(ORDER)
    backwards = {
        f"{path.relative_to(ROOT)} from {other}"
        for room in ORDER
        for path in (ROOT / room).rglob("*.py")
        for other in _imported(path) & rooms
        if ORDER.index(other) > ORDER.index(room)
    }
    assert not backwards

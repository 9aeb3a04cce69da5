"""Lazy packages, which import a module when one of its names is first used."""

import dis
import importlib
import sys
from collections.abc import Callable, Iterator
from types import CodeType
from typing import Any


def when_asked(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, from the imports under `if TYPE_CHECKING`.

    Creating a component class takes a millisecond or two, and a model uses only a few of several hundred. The imports
    are read from the compiled code, which is available even without the source, for example in frozen programs.
    """
    module = sys.modules[package]
    assert module.__spec__ is not None
    loader: Any = module.__spec__.loader
    modules = {name: path for name, path in _relative_imports(loader.get_code(package)) if name != "when_asked"}

    def attribute(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=module)
        value = getattr(importlib.import_module(modules[name], package), name)
        setattr(module, name, value)
        return value

    return attribute, lambda: list(modules), list(modules)


def _relative_imports(code: CodeType) -> Iterator[tuple[str, str]]:
    """Name and module of each `from .module import name` in a module, including branches that do not run."""
    level, names = 0, ()
    for step in dis.get_instructions(code):
        if step.opname == "IMPORT_NAME" and level:
            yield from ((name, "." * level + step.argval) for name in names)
        level, names = names, step.argval

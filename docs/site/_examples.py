"""Examples of the classes of the library: their code and their instances."""

import ast
import functools as ft
import importlib
import inspect
import textwrap
from typing import Any, NamedTuple


class Example(NamedTuple):
    """The code that makes an instance, and the names that it imports by package."""

    code: str
    imports: dict[str, set[str]]
    instance: Any


@ft.cache
def examples(domain: str) -> dict[str, Example]:
    """The examples of a domain by class name."""
    module = importlib.import_module(f".examples.{domain}", __package__)
    source = inspect.getsource(module)
    tree = ast.parse(source)
    packages = {
        name.asname or name.name: node.module or ""
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for name in node.names
    }
    written = next(node.value for node in tree.body if isinstance(node, ast.Assign))
    assert isinstance(written, ast.Tuple)
    found = {}
    for node, instance in zip(written.elts, module.EXAMPLES, strict=True):
        lines = " " * node.col_offset + (ast.get_source_segment(source, node) or "")
        imports: dict[str, set[str]] = {}
        for name in {one.id for one in ast.walk(node) if isinstance(one, ast.Name)} & packages.keys():
            imports.setdefault(packages[name], set()).add(name)
        found[type(instance).__name__] = Example(textwrap.dedent(lines), imports, instance)
    return found

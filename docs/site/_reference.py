"""Reference of the public names of a module as Markdown: signature, docstring, fields and methods."""

import ast
import inspect
import re
import textwrap
import types
from collections.abc import Iterator
from typing import Any, NamedTuple

import acausal
import studies
from acausal import codegen, design, fmi, modelica, testing
from acausal._declare.class_card import own_text
from studies import actuators

from .._execute import ROOT
from ._pages import Pages, SiteError
from ._tables import table

WIDTH = 100
PYTREE = ("tree_flatten", "tree_unflatten")  # jax calls these methods; users do not
_GROUP = re.compile(r"^(?P<title>\S.*):\n(?P<lines>(?:    .*\n?)+)", re.MULTILINE)
_LINE = re.compile(r"^    (?P<names>\w+\*?(?:,\s+\w+\*?)*)\s+(?P<text>\S.*(?:\n     .*)*)", re.MULTILINE)


class Group(NamedTuple):
    """Names of a module with the descriptions in its docstring, if it has any."""

    title: str
    names: dict[str, str]
    module: types.ModuleType


def reference(name: str, pages: Pages) -> str:
    """The reference page of a module."""
    return "\n".join(_page(name, pages)) + "\n"


def _page(name: str, pages: Pages) -> Iterator[str]:
    page = f"reference/{name}.md"
    for group in GROUPS[name]:
        yield f"\n## {group.title}\n"
        for item, text in group.names.items():
            yield from _entry(group.module, item, text, page, pages)


def public(module: types.ModuleType) -> list[str]:
    """The public names of a module, without its submodules."""
    names = [name for name in vars(module) if not name.startswith("_")]
    return [name for name in names if not inspect.ismodule(getattr(module, name))]


def _groups(module: types.ModuleType) -> list[Group]:
    """The names of `acausal` under the headings of its docstring; they must be all."""
    found = []
    for match in _GROUP.finditer(inspect.getdoc(module) or ""):
        names: dict[str, str] = {}
        for line in _LINE.finditer(match["lines"]):
            names |= dict.fromkeys(re.findall(r"\w+", line["names"]), " ".join(line["text"].split()))
        found.append(Group(match["title"], names, module))
    if missing := set(public(module)) - {name for group in found for name in group.names}:
        raise SiteError(f"The docstring of {module.__name__} does not list {', '.join(sorted(missing))}.")
    return found


def _kinds(module: types.ModuleType, prefix: str = "") -> list[Group]:
    """Functions, classes and constants of a module."""
    groups = {kind: Group(f"{prefix}{kind}", {}, module) for kind in ("Functions", "Classes", "Constants")}
    for name in sorted(public(module)):
        item = getattr(module, name)
        kind = "Classes" if inspect.isclass(item) else "Functions" if callable(item) else "Constants"
        groups[kind].names[name] = ""
    return [group for group in groups.values() if group.names]


def _entry(module: types.ModuleType, name: str, text: str, page: str, pages: Pages) -> Iterator[str]:
    item = getattr(module, name)
    path = f"{module.__name__}.{name}"
    yield f"\n### {name} {{ #{path} }}\n"
    if not (inspect.isfunction(inspect.unwrap(item)) or inspect.isclass(item)):
        value = _short(item)
        yield f"{text}\n" if text or value == "..." else f"```python\n{name} = {value}\n```\n"
        return
    yield _signature(name, item)
    yield (own_text(item) if inspect.isclass(item) else inspect.getdoc(item) or "") + "\n"
    if inspect.isclass(item):
        yield from _fields(item)
        yield from _methods(item, path)
    yield _source(item, page, pages)


def _signature(name: str, item: Any) -> str:
    """The call of a function with annotations, or of a class whose fields are all public."""
    try:
        parameters = list(inspect.signature(item).parameters.values())
    except (ValueError, TypeError):
        return ""
    if inspect.isclass(item):
        shown = [str(one.replace(annotation=one.empty)) for one in parameters if " at 0x" not in str(one)]
        return "" if any(one.name.startswith("_") for one in parameters) else _call(name, shown, "")
    function = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(item)))).body[0]
    assert isinstance(function, ast.FunctionDef)
    result = f" -> {ast.unparse(function.returns)}" if function.returns else ""
    return _call(name, _arguments(function.args), result)


def _arguments(given: ast.arguments) -> list[str]:
    """The arguments of a function as they are written, one by one."""
    positional = [*given.posonlyargs, *given.args]
    defaults = [None] * (len(positional) - len(given.defaults)) + given.defaults
    shown = [_argument(one, value) for one, value in zip(positional, defaults, strict=True)]
    if given.vararg or given.kwonlyargs:
        shown.append(f"*{_argument(given.vararg, None)}" if given.vararg else "*")
    shown += [_argument(one, value) for one, value in zip(given.kwonlyargs, given.kw_defaults, strict=True)]
    return shown + [f"**{_argument(given.kwarg, None)}"] * (given.kwarg is not None)


def _argument(one: ast.arg | None, default: ast.expr | None) -> str:
    return (ast.unparse(one) if one else "") + (f" = {ast.unparse(default)}" if default else "")


def _call(name: str, arguments: list[str], result: str) -> str:
    line = f"{name}({', '.join(arguments)}){result}"
    if len(line) > WIDTH:
        line = f"{name}(\n" + "".join(f"    {one},\n" for one in arguments) + f"){result}"
    return f"```python\n{line}\n```\n"


def _short(value: Any) -> str:
    """The representation of a value; three dots for one of several lines or with an address in memory."""
    text = getattr(value, "__name__", "") or repr(value)
    return text if len(text) < WIDTH and "\n" not in text and " at 0x" not in text else "..."


def _fields(cls: Any) -> Iterator[str]:
    """The public fields that a class annotates, with the comments behind them."""
    names = [name for name in inspect.get_annotations(cls) if not name.startswith("_")]
    if names and not issubclass(cls, acausal.Component):
        source = inspect.getsource(cls)
        rows = []
        for name in names:
            comment = re.search(
                rf"^    {name}: (?P<type>[^#=\n]*?)(?: = .*?)?(?:  # (?P<note>.*))?$", source, re.MULTILINE
            )
            rows.append((f"`{name}`", f"`{comment['type']}`" if comment else "", (comment and comment["note"]) or ""))
        yield f"**Fields**\n\n{table(('Name', 'Type', 'Meaning'), rows)}"


def _methods(cls: Any, path: str) -> Iterator[str]:
    """The public methods and properties that have a docstring, those of private bases included."""
    bases = [base for base in cls.__mro__ if base.__module__.split(".")[0] in ("acausal", "studies")]
    private = [base for base in bases if base is cls or not hasattr(acausal, base.__name__)]
    found = {name: raw for base in reversed(private) for name, raw in vars(base).items()}
    for name, raw in found.items():
        item = raw.__func__ if isinstance(raw, classmethod | staticmethod) else raw
        head = f"#### {name} {{ #{path}.{name} }}\n"
        if name.startswith("_") or name in PYTREE or not getattr(item, "__doc__", None):
            continue
        if isinstance(item, property):
            yield f"{head}\n{inspect.getdoc(item)}\n"
        elif inspect.isfunction(item):
            yield f"{head}\n{_signature(name, item)}\n{inspect.getdoc(item)}\n"


def _source(item: Any, page: str, pages: Pages) -> str:
    item = inspect.unwrap(item)
    file = inspect.getsourcefile(item) or ""
    path = file.removeprefix(f"{ROOT}/")
    return f"\n**Source**: [{path}]({pages.source(path, inspect.getsourcelines(item)[1], page)})\n"


def _listed() -> dict[str, list[Group]]:
    return {
        "acausal": _groups(acausal),
        "design": _kinds(design),
        "testing": _kinds(testing),
        "codegen": _kinds(codegen),
        "fmi": _kinds(fmi),
        "modelica": _kinds(modelica),
        "studies": [*_kinds(studies, "`studies`: "), *_kinds(actuators, "`studies.actuators`: ")],
    }


GROUPS = _listed()

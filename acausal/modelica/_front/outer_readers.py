"""Parameters whose values the front end ignores: fields of records, and those that read outer components or arrays."""

import re
from typing import Any, NamedTuple

from .._errors import ModelicaError
from .marks import marks
from .outer_marks import outer_components
from .scan import masked, section_of
from .selections import deciding, references
from .sources import Sources

_Tree = dict[str, Any]
_SIZES = "ArrayDimension"  # selections that rumoca makes with the modified values
_RANGE = re.compile(r"\bfor\s+\w+\s+in\b(.*?)(?:\bloop\b|[;}])", re.S)


class OuterParameter(NamedTuple):
    """A parameter of an outer component: its path, that of the parameter of the inner component, and its name in the
    class that declares the outer component.
    """

    outer: str
    inner: str
    local: str


def check_direct(content: _Tree, parameters: list[OuterParameter], sources: Sources) -> None:
    """Raises `ModelicaError` for a condition or range that reads one of these parameters directly."""
    paths = {one.outer for one in parameters}
    for choice in content.get("parameter_branch_selections", ()):
        for full, *_ in choice["references"] if choice["kind"] != _SIZES else ():
            if full in paths:
                raise _direct(full, _where(choice, "span", sources))
    for source in sources.texts if parameters else ():
        _check_ranges(source, {one.local: one.outer for one in parameters}, sources)


def _check_ranges(source: int, names: dict[str, str], sources: Sources) -> None:
    """Raises `ModelicaError` for a range in the equations or algorithms of a text that reads one of these names. The
    flat model does not show ranges in algorithms and in array constructors.
    """
    plain = masked(sources.texts[source][1])
    for found in _RANGE.finditer(plain):
        name = next((name for name in re.findall(r"(?<![\w.])\w+(?:\.\w+)+", found[1]) if name in names), None)
        if name is not None and section_of(plain, found.start()) in ("equation", "algorithm"):
            raise _direct(names[name], sources.where(source, len(plain[: found.start()].encode())))


def _direct(full: str, place: str) -> ModelicaError:
    return ModelicaError(
        f"{place}{full} selects equations, but the front end ignores its value. "
        f"Remedy: in the class that uses it, declare a parameter that equals the outer one and use that."
    )


def readers(content: _Tree, inner: set[str], sources: Sources) -> set[str]:
    """The parameters whose values read one of these parameters of inner components, except real parameters that select
    no equations.
    """
    variables, types, selects = content["variables"], content["variable_type_names"], deciding(content)
    found = set()
    for name, variable in variables.items():
        if name in inner or (types.get(name) == "Real" and name not in selects):
            continue
        if any(other in inner for other in references(variable["binding"])):
            _refuse_final(content, name, sources)
            found.add(name)
    return _with_all_elements(found, variables)


def misread(content: _Tree) -> set[str]:
    """The parameters that select equations, components or sizes, whose values the front end does not find.

    These are fields of records, and those that read arrays, as in `part(data = Data(n = 3))` and `part(n = ns[2])`. The
    front end takes the values that their classes declare. For sizes of components, it finds only values of literals and
    names, except outer ones. Final parameters have no modifier, except some that are final by a modifier themselves.
    """
    variables = content["variables"]
    sizes = set(references([variable["binding"] for *_, variable in marks(content, "size")]))
    inner = [path for _, path in outer_components(content)]
    found = set()
    for name in deciding(content):
        variable = variables[name]
        binding, is_modified = variable["binding"], variable["binding_from_modification"]
        is_field = is_modified and name.rpartition(".")[0] in content["record_instances"]
        reads_outer = any(is_in(read, one) for read in references(binding) for one in inner)
        is_final = content["variable_final_flags"].get(name, False)
        is_size = name in sizes and (reads_outer or not _is_plain(binding)) and not is_final
        reads_array = not variable["dims"] and _reads_array(binding, variables)
        if is_field or is_size or (reads_array and (is_modified or not is_final)):
            found.add(name)
    return _with_all_elements(found, variables)


def _refuse_final(content: _Tree, name: str, sources: Sources) -> None:
    """Raises `ModelicaError` for a final parameter, to which no modifier can give its value."""
    if content["variable_final_flags"].get(name):
        raise ModelicaError(
            f"{_where(content['variables'][name], 'source_span', sources)}{name} is final and reads an outer "
            f"component, but the front end ignores its value. Remedy: declare {name} without final."
        )


def _with_all_elements(names: set[str], variables: _Tree) -> set[str]:
    """The variables with these names, in all elements of the arrays of components around them."""
    plain = {_without_indices(name) for name in names}
    return {name for name in variables if _without_indices(name) in plain}


def _reads_array(node: Any, variables: _Tree) -> bool:
    """Whether an expression reads an array or one of its elements, other than its size."""
    if isinstance(node, list):
        return any(_reads_array(inner, variables) for inner in node)
    if not isinstance(node, dict) or node.get("BuiltinCall", {}).get("function") == "Size":
        return False
    if "VarRef" in node:
        own = variables.get(node["VarRef"]["name"]["name"])
        return bool(node["VarRef"]["subscripts"]) or (own is not None and bool(own["dims"]))
    return any(_reads_array(inner, variables) for inner in node.values())


def _is_plain(binding: _Tree | None) -> bool:
    """Whether the value of a parameter is a literal or a name, or not given."""
    return binding is None or bool({"Literal", "VarRef"} & binding.keys())


def is_in(name: str, component: str) -> bool:
    """Whether a path is that of a component or of a part of it."""
    return name == component or name.startswith(f"{component}.")


def _where(node: _Tree, span: str, sources: Sources) -> str:
    return sources.where(node[span]["source"], node[span]["start"])


def _without_indices(path: str) -> str:
    return re.sub(r"\[[^\]]*\]", "", path)

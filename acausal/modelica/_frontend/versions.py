"""Versions of libraries (Modelica 3.6, section 18.9)."""

from collections.abc import Sequence

from . import tree as t
from .library import Definition, Libraries


def version_wanted(name: str, users: Sequence[Definition]) -> str | None:
    """The version of a library in the annotation `uses` of the first user that has it; empty if it states none."""
    stated = (_uses(user) for user in users)
    return next((found[name] for found in stated if name in found), None)


def version_warnings(libraries: Libraries) -> tuple[str, ...]:
    """A warning for each library that a class uses in another version than the one found."""
    loaded = {one.tree.name: one for one in libraries.loaded()}
    warnings: list[str] = []
    for user in loaded.values():
        for name, wanted in _uses(user).items():
            found = loaded.get(name)
            version = _texts(found, "version") if found is not None else []
            if found is None or not wanted or not version or wanted in (*version, *_texts(found, *_UNCHANGED)):
                continue
            script = ", and needs a conversion from it" if wanted in _texts(found, *_CONVERTED) else ""
            warnings.append(
                f"{user.source.file}: {user.tree.name} uses {name} {wanted}, but the library found is {name} "
                f"{version[0]} ({found.source.file}){script}. Remedy: give the folder of {name} {wanted} by "
                f"roots=[...], or convert {user.tree.name} and change its annotation `uses`."
            )
    return tuple(warnings)


_UNCHANGED = ("conversion", "noneFromVersion")
_CONVERTED = ("conversion", "from", "version")


def _uses(user: Definition) -> dict[str, str]:
    """The versions in the annotation `uses(Library(version="1.0"))`."""
    annotation, found = user.tree.annotation, {}
    for used in annotation.named("uses") if annotation else ():
        for library in used.modification.arguments:
            if isinstance(library, t.ElementModification):
                found[library.name[0]] = "".join(_among(library.modification, ("version",))[:1])
    return found


def _texts(definition: Definition, *names: str) -> list[str]:
    annotation = definition.tree.annotation
    return [] if annotation is None else _among(annotation, names)


def _among(modification: t.Modification, names: Sequence[str]) -> list[str]:
    """The texts that a modification gives to a name, or to a name within others."""
    if names:
        return [text for one in modification.named(names[0]) for text in _among(one.modification, names[1:])]
    value = modification.value
    items = value.elements if isinstance(value, t.Array) else (value,)
    return [item.value for item in items if isinstance(item, t.Literal) and isinstance(item.value, str)]

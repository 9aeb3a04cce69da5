"""Elements of the language that the front end loses, or evaluates, without a trace in the flat model."""

import re
from collections.abc import Iterator

from .._errors import ModelicaError
from .scan import closed, masked, section_of
from .sources import Sources

_RANGE = re.compile(r"\bfor\s+\w+\s+in\s+(?P<size>[^\[\];()]*\w\s*\[[^;]*?)\bloop\b")
_FIXED = re.compile(r"\bfixed\s*=(?!=)\s*(?P<value>[^,;)]*?(?:<(?!>)|(?<!<)>)[^,;)]*)")
_INNER = re.compile(r"\binner\s+(?P<name>function\s+\w+)\s*(?:=\s*[\w.]+\s*\(|extends\s+[\w.]+\s*\()")
_CONSTRAINT = re.compile(
    r"\breplaceable\s+(?:(?:model|package|block|record|connector|type)\s+\w+\s*=|[\w.]+\s+(?P<name>\w+)\s*(?:\[[^\]]*\]\s*)?(?P<own>\())"
    r'[^;"]*\bconstrainedby\s+[\w.]+\s*(?P<other>\()?'
)
_PACKAGE = re.compile(r"\bpackage\s+\w+\s*(?:extends|=)\s*(?P<base>[\w.]+)\s*\(\s*(?!redeclare\b|\))")
_REDECLARED = (
    "the front end loses the redeclaration in the modifier of a modifier. Remedy: write a model that extends the class "
    "of the component with the redeclaration."
)


def check_texts(sources: Sources, modifiers: str) -> None:
    """Raises `ModelicaError` for these elements, such as a loop of equations whose range reads an element of an array,
    as in `for i in 1:n[2] loop`, and an attribute `fixed` that is a relation, as in `x(fixed = k > 1)`.
    `modifiers` are those of the loaded model.
    """
    for _ in inner_redeclarations(masked(modifiers)):
        raise ModelicaError(f"{modifiers}: {_REDECLARED}")
    for source, (_, text) in sources.texts.items():
        plain = masked(text)
        for at, error in (*_values(plain), *_classes(plain)):
            raise ModelicaError(f"{sources.where(source, len(text[:at].encode()))}{error}")


def _values(plain: str) -> Iterator[tuple[int, str]]:
    for found in _RANGE.finditer(plain):
        if section_of(plain, found.start()) == "equation":
            yield (
                found.start(),
                f"the front end loses the range {found['size'].strip()}, which reads an array. Remedy: declare an "
                "Integer parameter with a value of its own, and use that.",
            )
    for found in _FIXED.finditer(plain):
        yield (
            found.start(),
            f"fixed = {found['value'].strip()} is evaluated when the model is loaded. Remedy: declare a Boolean "
            "parameter with this value, and use that.",
        )


def _classes(plain: str) -> Iterator[tuple[int, str]]:
    for found in _INNER.finditer(plain):
        yield (
            found.start(),
            f"the front end loses the modifiers of the inner {found['name']}. Remedy: write these values in its body.",
        )
    for found in _CONSTRAINT.finditer(plain):
        own, other = (_modifiers(plain, found.start(part)) for part in ("own", "other"))
        if other and own != other:
            yield (
                found.start(),
                "the front end loses modifiers after constrainedby. Remedy: write them where the class is declared, "
                "and in each redeclaration.",
            )
        again = rf"\bredeclare\s+(?:each\s+)?(?:final\s+)?[\w.]+\s+{found['name']}\b(?!\s*=)"
        if own and own != other and re.search(again, plain):
            yield (
                found.start(),
                f"the front end applies the modifiers of {found['name']} to its redeclarations, too. Remedy: redeclare "
                "a class instead of the component.",
            )
    for found in _PACKAGE.finditer(plain):
        base = found["base"].rpartition(".")[2]
        if re.search(rf"(?<!\bextends\s)(?<!import\s)(?<!\w)(?:\w+\.)*{base}\.\w", plain):
            yield (
                found.start(),
                f"with modified constants of {base} in another package, the front end gives them to {base} itself. "
                f"Remedy: use a package P of its own for the values of {base}: package P = {base}.",
            )
    for at in inner_redeclarations(plain):
        yield at, _REDECLARED


def inner_redeclarations(plain: str) -> Iterator[int]:
    """The places of redeclarations in the modifiers of modifiers, in a masked text."""
    for found in re.finditer(r"\bredeclare\b", plain):
        before = plain[plain.rfind(";", 0, found.start()) + 1 : found.start()]
        if before.count("(") - before.count(")") > 1 and "annotation" not in before:
            yield found.start()


def _modifiers(plain: str, at: int) -> str:
    """The modifiers in the brackets at a place, without blanks; empty if there are none."""
    return "".join(plain[at : closed(plain, at)].split()) if at >= 0 else ""

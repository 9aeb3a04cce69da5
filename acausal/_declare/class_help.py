"""Documentation that classes of components, ports and records generate on demand."""

import inspect
import types
from collections.abc import Iterable
from typing import Any

import equinox as eqx

_SPECIAL = {*dir(eqx.Module), "__check_init__", "__getattr__", "__setstate__"}


class OwnText(str):
    """The docstring in the source of a class. Instances read the generated one, as their class does."""

    def __get__(self, instance: object, cls: type) -> str | None:
        return cls.__doc__


def class_text(cls: Any) -> str:
    """The docstring of a class with tables of its parameters, ports and variables."""
    if "_partial" not in vars(cls):
        return " "  # dataclasses would replace an empty text by the signature
    from .class_card import as_text, card_of

    return as_text(card_of(cls))


def class_html(cls: Any) -> str:
    """The same for a notebook."""
    from .class_card import as_html, card_of

    return as_html(card_of(cls))


def html_method(cls: Any) -> types.MethodType:
    """`class_html` as a method of a class: notebooks ignore other attributes of classes."""
    return types.MethodType(class_html, cls)


def plain_signature(cls: Any) -> inspect.Signature:
    """The signature of the constructor without annotations, the argument `nominal` of all components last."""
    found = list(inspect.signature(cls.__init__).parameters.values())[1:]
    ordered = sorted(found, key=lambda parameter: (parameter.kind, parameter.name == "nominal"))
    return inspect.Signature([parameter.replace(annotation=parameter.empty) for parameter in ordered])


def attributes(cls: Any, names: Iterable[str]) -> list[str]:
    """The attributes of a class without its fields and without special names, which would fill the page of `help`."""
    left_out = _SPECIAL | getattr(cls, "__dataclass_fields__", {}).keys()
    return [name for name in names if name not in left_out]

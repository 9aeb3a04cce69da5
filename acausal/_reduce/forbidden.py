"""A placeholder for values that a component's code must not use."""

from typing import NoReturn

from .._errors import ModelError


class Forbidden:
    """Any computation or comparison raises a `ModelError` with this text. Elements are forbidden, too."""

    def __init__(self, text: str) -> None:
        self._text = text

    def _raise(self, *args: object) -> NoReturn:
        raise ModelError(self._text)

    def __getitem__(self, index: object) -> "Forbidden":
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _raise
    __neg__ = __pow__ = __matmul__ = __rmatmul__ = __float__ = __jax_array__ = _raise
    __lt__ = __le__ = __gt__ = __ge__ = __abs__ = _raise

"""What stands where a component's own code may use nothing."""

from typing import Any

from .._errors import ModelError


class Forbidden:
    """Computing with it, comparing it or indexing it is a `ModelError` with this text."""

    def __init__(self, text: str) -> None:
        self._text = text

    def _raise(self, *args: Any) -> Any:
        raise ModelError(self._text)

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _raise
    __neg__ = __pow__ = __matmul__ = __rmatmul__ = __getitem__ = __float__ = __jax_array__ = _raise
    __lt__ = __le__ = __gt__ = __ge__ = __abs__ = _raise

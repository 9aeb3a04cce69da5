"""C code of models, for real-time targets and for tools that call compiled models.

`export_c` writes it.
"""

from .export import export_c as export_c

__all__ = ["export_c"]

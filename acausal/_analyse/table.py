"""Tables of modes and of shares in them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jax import Array

MOST_MODES, LEAST_SHARE = 12, 0.005  # maximum number of modes shown; least share of a shown row


def shown(poles: Any) -> list[int]:
    """One column for each mode: in a conjugate pair, the pole above the real axis."""
    return [i for i, pole in enumerate(np.asarray(poles)) if pole.imag >= 0]


def without_rounding(poles: Any) -> Any:
    """Poles with rounding errors around zero removed."""
    poles = np.asarray(poles)
    sizes = np.abs(poles)
    return np.where(sizes <= len(poles) * np.finfo(float).eps * np.max(sizes, initial=0.0), 0.0, poles)


def pole_name(pole: complex) -> str:
    """A real pole, or a conjugate pair."""
    return f"{pole.real:.4g} ± {pole.imag:.4g}i" if pole.imag else f"{pole.real:.4g}"


def mode_name(pole: complex) -> str:
    """The undamped frequency of an oscillation, or the pole of a decay."""
    return f"{abs(pole) / (2 * np.pi):.4g} Hz" if pole.imag else f"{pole.real:.4g} 1/s"


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Aligned columns, the first one left, the others right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


def share_table(title: str, names: Sequence[str], shares: Array | np.ndarray, poles: Any) -> str:
    """Shares by part (down) and mode (across)."""
    poles, shares = without_rounding(poles), np.asarray(shares)
    columns = shown(poles)[:MOST_MODES]
    rows = [i for i in range(len(names)) if np.any(np.abs(shares[i]) >= LEAST_SHARE)]
    cells = [[f"{shares[i, j]:.3f}" if abs(shares[i, j]) >= 5e-4 else "" for j in columns] for i in rows]
    head = [title, *(mode_name(poles[j]) for j in columns)]
    text = aligned([head, *([names[i], *line] for i, line in zip(rows, cells, strict=True))])
    hidden = [
        *([f"{len(shown(poles)) - len(columns)} more modes"] if len(columns) < len(shown(poles)) else []),
        *([f"{len(names) - len(rows)} rows below {LEAST_SHARE:g}"] if len(rows) < len(names) else []),
    ]
    return text + ("\n" + ", ".join(hidden) + " not shown" if hidden else "")


def number(value: float) -> str:
    """A number with four digits; empty for NaN."""
    return "" if np.isnan(value) else f"{value:.4g}"

"""Pieces of symbols, as data of SVG paths."""

from acausal import Symbol


def at(x: float, y: float, path: str) -> str:
    """A path in relative coordinates from a point."""
    return f"M{x:g} {y:g}{path}"


def with_port(name: str, x: int, y: int, lead: str) -> Symbol:
    """A port on the right or below, to add to a symbol, with a lead that begins there."""
    size = (x, y + 10) if lead.startswith("h") else (x + 10, y)
    return Symbol(*size, {name: (x, y)}, leads={name: at(x, y, lead)})


def circle(x: float, y: float, r: float) -> str:
    return f"M{x - r:g} {y:g}a{r:g} {r:g} 0 1 0 {2 * r:g} 0a{r:g} {r:g} 0 1 0 {-2 * r:g} 0z"


def rect(x: float, y: float, width: float, height: float) -> str:
    return f"M{x:g} {y:g}h{width:g}v{height:g}h{-width:g}z"


def head(x: float, y: float, right: float, down: float, size: float = 7.0) -> str:
    """The head of an arrow, as an area: its tip, and the direction, whose length is one."""
    back, half = (x - size * right, y - size * down), 0.42 * size
    return (
        f"M{x:g} {y:g}L{back[0] - half * down:.4g} {back[1] + half * right:.4g}"
        f"L{back[0] + half * down:.4g} {back[1] - half * right:.4g}z"
    )


# Across, from one end on a line to the other.
SPRING = "h12l3-8 6 16 6-16 6 16 6-16 6 16 3-8h12"  # 60 long, 16 high
SHORT_SPRING = "l2-5 4 10 4-10 4 10 2-5"  # 16 long, 10 high

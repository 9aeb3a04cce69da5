"""Slopes at the knots of piecewise cubics."""

from typing import Any

from .kinds import Smoothness, library_of


def chords(x: Any, y: Any) -> Any:
    """The slopes of the lines between knots, along the first axis of y."""
    steps = x[1:] - x[:-1]
    return (y[1:] - y[:-1]) / steps.reshape(steps.shape + (1,) * (y.ndim - 1))


def lengthened(d: Any, count: int) -> Any:
    """Values continued by `count` linear steps at both ends of the first axis."""
    xp = library_of(d)
    if len(d) == 1:
        return xp.concatenate([d] * (2 * count + 1))
    before = [d[:1] + k * (d[:1] - d[1:2]) for k in range(count, 0, -1)]
    after = [d[-1:] + k * (d[-1:] - d[-2:-1]) for k in range(1, count + 1)]
    return xp.concatenate([*before, d, *after])


def weights(d: Any, *, modified: bool = False) -> tuple[Any, Any]:
    """The weights of the chords before and after each knot (Akima 1970; modified: Ionita 2019); 1 if both vanish."""
    xp = library_of(d)
    change = xp.abs(d[1:] - d[:-1])
    if modified:
        change = change + 0.5 * xp.abs(d[1:] + d[:-1])
    before, after = change[2:], change[:-2]
    vanish = before + after == 0.0
    return xp.where(vanish, 1.0, before), xp.where(vanish, 1.0, after)


def _akima(d: Any, *, modified: bool) -> Any:
    whole = lengthened(d, 2)
    before, after = weights(whole, modified=modified)
    return (before * whole[1:-2] + after * whole[2:-1]) / (before + after)


def _monotone(x: Any, d: Any, inner: Any) -> Any:
    """Zero at an extremum, `inner` at other knots, and at the ends the slope of the outermost chord."""
    xp = library_of(d)
    same = d[:-1] * d[1:] > 0.0
    return xp.concatenate([d[:1], xp.where(same, inner, 0.0), d[-1:]])


def _fritsch_butland(x: Any, d: Any) -> Any:
    """The weighted harmonic mean of the neighbouring chords (Fritsch, Butland 1984)."""
    xp = library_of(x, d)
    h = (x[1:] - x[:-1])[:, None]
    left, right = h[:-1], h[1:]
    same = d[:-1] * d[1:] > 0.0
    below = (left + 2.0 * right) * d[1:] + (right + 2.0 * left) * d[:-1]
    mean = 3.0 * (left + right) * d[:-1] * d[1:] / xp.where(same, below, 1.0)
    return _monotone(x, d, mean)


def _steffen(x: Any, d: Any) -> Any:
    """The slope of the parabola through three knots, limited to twice the flatter chord (Steffen 1990)."""
    xp = library_of(x, d)
    h = (x[1:] - x[:-1])[:, None]
    mean = (d[:-1] * h[1:] + d[1:] * h[:-1]) / (h[:-1] + h[1:])
    flat = 2.0 * xp.minimum(xp.abs(d[:-1]), xp.abs(d[1:]))
    return _monotone(x, d, xp.sign(d[:-1]) * xp.minimum(xp.abs(mean), flat))


def slopes(x: Any, y: Any, kind: Smoothness) -> Any:
    """The slopes at the knots x of each column of y."""
    d = chords(x, y)
    if kind is Smoothness.FRITSCH_BUTLAND:
        return _fritsch_butland(x, d)
    if kind is Smoothness.STEFFEN:
        return _steffen(x, d)
    return _akima(d, modified=kind is Smoothness.MODIFIED_AKIMA)


def akima(x: Any, y: Any) -> Any:
    """The slopes of Akima along the first axis of y."""
    return _akima(chords(x, y), modified=False)

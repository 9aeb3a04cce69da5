"""Dimensions as exponents of the SI base units."""

import dataclasses
import functools as ft
from collections.abc import Iterable
from fractions import Fraction

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd")


@dataclasses.dataclass(frozen=True)
class Dimension:
    """A product of powers of the SI base units; an angle is a number. `str` uses the notation of Modelica."""

    exponents: tuple[Fraction | int, ...] = (0,) * len(BASE_UNITS)

    def __mul__(self, other: "Dimension") -> "Dimension":
        return Dimension(tuple(a + b for a, b in zip(self.exponents, other.exponents, strict=True)))

    def __truediv__(self, other: "Dimension") -> "Dimension":
        return Dimension(tuple(a - b for a, b in zip(self.exponents, other.exponents, strict=True)))

    def __pow__(self, exponent: Fraction | int) -> "Dimension":
        factor = whole(exponent)
        return Dimension(tuple(factor * a for a in self.exponents))

    def __str__(self) -> str:
        pairs = list(zip(BASE_UNITS, self.exponents, strict=True))
        above = _product((unit, exponent) for unit, exponent in pairs if exponent > 0)
        below = _product((unit, -exponent) for unit, exponent in pairs if exponent < 0)
        if not below:
            return above or "1"
        return f"{above or '1'}/" + (f"({below})" if "." in below else below)


def _product(factors: Iterable[tuple[str, Fraction | int]]) -> str:
    return ".".join(f"{unit}{'' if exponent == 1 else _number(exponent)}" for unit, exponent in factors)


def whole(exponent: Fraction | int) -> Fraction | int:
    """The same number, as an integer if possible: arithmetic of Python is ten times faster with these."""
    return exponent.numerator if exponent.denominator == 1 else exponent


def _number(exponent: Fraction | int) -> str:
    return str(exponent) if exponent.denominator == 1 else f"^({exponent})"


@ft.cache
def base(unit: str) -> Dimension:
    """The dimension of a base unit."""
    return Dimension(tuple(int(unit == other) for other in BASE_UNITS))


NUMBER = Dimension()
TIME = base("s")
LENGTH = base("m")


def _derived() -> dict[Dimension, str]:
    """Names of dimensions that are common in machines and circuits."""
    kg, m, s, A, K = map(base, ("kg", "m", "s", "A", "K"))
    N = kg * m / s**2
    J, Pa = N * m, N / m**2
    W = J / s
    V = W / A
    return {
        N: "N", J: "N.m", Pa: "Pa", W: "W", V: "V", A * s: "C", V / A: "ohm", V * s: "Wb", V * s / A: "H",
        A * s / V: "F", V * s / m**2: "T", N / m: "N/m", N * s / m: "N.s/m", J * s: "N.m.s", J * s**2: "kg.m2",
        Pa * s: "Pa.s", Pa / m**3: "Pa/m3", Pa * s / m**3: "Pa.s/m3", m**3 / (s * Pa): "m3/(s.Pa)",
        J / K: "J/K", W / K: "W/K", W / (m * K): "W/(m.K)", W / (m**2 * K): "W/(m2.K)", J / (kg * K): "J/(kg.K)",
        V / m: "V/m", A / V: "A/V",
    }  # fmt: skip


DERIVED = _derived()


def si_unit_of(dimension: Dimension) -> str:
    """The SI unit of a dimension, "1" for a number."""
    return "1" if dimension == NUMBER else DERIVED.get(dimension, str(dimension))


def described(dimension: Dimension, unit: str | None = None) -> str:
    """Text of a dimension, such as `N.m (kg.m2/s2)`; `unit` is the declared one, if any."""
    basic = str(dimension)
    name = unit or DERIVED.get(dimension, basic)
    return basic if name == basic else f"{name} ({basic})"

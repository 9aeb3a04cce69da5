"""Typical sizes of variables, by unit, where none is declared."""

# Machinery between the size of a hand and of a person: an engineer's guess, to a factor of ten. Error tolerances are
# relative to the larger of a variable and this size.
BY_UNIT = {
    "rad": 1.0,
    "rad/s": 10.0,
    "N.m": 1.0,
    "m": 1e-2,
    "m/s": 0.1,
    "N": 100.0,
    "V": 1.0,
    "A": 1.0,
    "C": 1e-3,
    "Wb": 1e-2,
    "Pa": 1e5,
    "m3": 1e-6,
    "m3/s": 1e-5,
    "K": 100.0,
    "W": 10.0,
    "J": 1.0,
}


def nominal_size(unit: str, declared: float | None) -> float:
    """The declared nominal size, else that of the unit, else 1."""
    return BY_UNIT.get(unit, 1.0) if declared is None else declared

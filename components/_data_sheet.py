"""Data sheets of purchased parts."""

import dataclasses

from acausal import ParameterError


@dataclasses.dataclass(frozen=True)
class DataSheet:
    """The figures of a data sheet in SI units, with their source; `sheet["resistance"]` is one of them.

    A component made from a data sheet keeps it, so that a run can be checked against the ratings.
    """

    catalogue: str  # name of the table that lists the part
    order: str  # order name
    family: str
    maker: str
    source: str
    date: str
    figures: tuple[tuple[str, float], ...]  # names and values, in SI units, of the figures stated
    units: tuple[tuple[str, str], ...]  # names and SI units of all figures that a sheet can state

    def __getitem__(self, name: str) -> float:
        """A figure; raises `ParameterError` if the sheet does not state it."""
        value = self.get(name)
        if value is None:
            known = ", ".join(name for name, _ in self.figures)
            raise ParameterError(f"{self.catalogue}, {self.order}: {name} is not stated. Stated are {known}.")
        return value

    def get(self, name: str) -> float | None:
        """A figure, or None if the sheet does not state it."""
        return dict(self.figures).get(name)

    def unit(self, name: str) -> str:
        """The SI unit of a figure."""
        return dict(self.units)[name]

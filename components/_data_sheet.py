"""What the maker of a part states of it."""

import dataclasses

from acausal import ParameterError


@dataclasses.dataclass(frozen=True)
class DataSheet:
    """The figures of a data sheet in SI units, with where they come from; `sheet["resistance"]` is one of them.

    Components that are made from it carry it along, so that a run can be held against its ratings.
    """

    catalogue: str  # name of the table it stands in
    order: str  # order name
    family: str
    maker: str
    source: str
    date: str
    figures: tuple[tuple[str, float], ...]  # names and values in SI units, those that are stated
    units: tuple[tuple[str, str], ...]  # names and SI units, of all that can be

    def __getitem__(self, name: str) -> float:
        """A figure; raises `ParameterError` where the sheet does not state it."""
        value = self.get(name)
        if value is None:
            known = ", ".join(name for name, _ in self.figures)
            raise ParameterError(f"{self.catalogue}, {self.order}: {name} is not stated. Stated are {known}.")
        return value

    def get(self, name: str) -> float | None:
        """A figure, or None where the sheet does not state it."""
        return dict(self.figures).get(name)

    def unit(self, name: str) -> str:
        """The SI unit of a figure."""
        return dict(self.units)[name]

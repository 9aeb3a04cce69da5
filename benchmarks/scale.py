"""Large models: how their parts grow with their number, each with its limit."""

from pathlib import Path

from ._effort import Effort
from ._grid import rows_of_grids
from ._pack import rows_of_packs
from ._rows import Row
from ._wall import rows_of_walls
from ._waves import rows_of_waves


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """All large models."""
    del out
    return [*rows_of_walls(effort), *rows_of_grids(effort), *rows_of_packs(effort), *rows_of_waves(effort)]

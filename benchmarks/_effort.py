"""The amount of work of the benchmarks."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Effort:
    """Sizes of all benchmarks; the defaults are those of the published numbers."""

    repeats: int = 200  # of each timing, the least of which counts
    evaluations: int = 20_000  # of a vector field in one loop
    decades: tuple[float, float, int] = (-3.0, -10.0, 15)  # exponents of the tolerances: from, to, number
    designs: int = 1024
    lengths: tuple[int, ...] = (10, 100, 1000, 5000)
    nodes: tuple[int, ...] = (100, 200, 1000, 100_000)
    grid: int = 60  # nodes in a row
    cells: int = 1000
    alike: int = 500
    processes: int = 3  # fresh ones, the fastest of which counts


TINY = Effort(
    repeats=2,
    evaluations=50,
    decades=(-4.0, -6.0, 3),
    designs=4,
    lengths=(10,),
    nodes=(10,),
    grid=4,
    cells=4,
    alike=10,
    processes=1,
)

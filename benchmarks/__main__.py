"""The command line: `python -m benchmarks --json FILE [--out DIR] [--only NAME ...]`."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from . import _rows
from ._effort import TINY, Effort
from ._rows import Row

Benchmark = Callable[[Effort, Path | None], list[Row]]


def benchmarks() -> dict[str, Benchmark]:
    """All benchmarks by name, in the order in which they run.

    Start-up comes first, before this process takes up memory and caches.
    """
    from . import batch, chain, cvodes, gradient, startup, vector_field

    return {
        "compile": lambda effort, _: startup.run(effort),
        "vector_field": lambda effort, _: vector_field.run(effort),
        "casadi": cvodes.run,
        "gradient": lambda effort, _: gradient.run(effort),
        "batch": lambda effort, _: batch.run(effort),
        "chain": chain.run,
    }


def main(arguments: list[str] | None = None) -> list[Row]:
    """Run, print and save."""
    available = benchmarks()
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--json", type=Path, help="where to save the rows")
    parser.add_argument("--out", type=Path, help="folder for the diagrams")
    parser.add_argument("--only", nargs="+", choices=list(available), help="which to run; all by default")
    parser.add_argument("--quick", action="store_true", help="with the smallest sizes, to see that it works")
    given = parser.parse_args(arguments)
    effort = TINY if given.quick else Effort()
    rows: list[Row] = []
    for name in given.only or available:
        start = time.perf_counter()
        found = available[name](effort, given.out)
        _rows.show(found)
        print(f"{name}: {time.perf_counter() - start:.0f} s\n")
        rows += found
    if given.json is not None:
        _rows.write(rows, given.json)
    return rows


if __name__ == "__main__":
    main()

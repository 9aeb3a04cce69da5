"""The command line: `python -m benchmarks --json FILE [--out DIR] [--only NAME ...]`."""

import argparse
import importlib
import os
import time
from pathlib import Path

from . import _rows
from ._effort import TINY, Effort
from ._rows import Row

# In the order in which they run: start-up first, before this process takes up memory and caches. Each is a module of
# its own, imported only when it runs, since CasADi need not be there for the others.
BENCHMARKS = {
    "first": "first_result",
    "vector_field": "vector_field",
    "casadi": "cvodes",
    "gradient": "gradient",
    "batch": "batch",
    "chain": "chain",
    "scale": "scale",
    "alike": "alike",
    "events": "events",
    "reading": "reading",
}


def main(arguments: list[str] | None = None) -> list[Row]:
    """Run, print and save."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Measure how fast the library is.")
    parser.add_argument("--json", type=Path, help="where to save the rows")
    parser.add_argument("--out", type=Path, help="folder for the diagrams")
    parser.add_argument("--only", nargs="+", choices=list(BENCHMARKS), help="which to run; all by default")
    parser.add_argument("--quick", action="store_true", help="with the smallest sizes, to see that it works")
    given = parser.parse_args(arguments)
    effort = TINY if given.quick else Effort()
    # Warm runs are those after the optimisation of their programs. First results are measured in other processes.
    os.environ.setdefault("ACAUSAL_OPTIMISE", "on")
    rows: list[Row] = []
    for name in given.only or BENCHMARKS:
        start = time.perf_counter()
        found = importlib.import_module(f".{BENCHMARKS[name]}", __package__).run(effort, given.out)
        _rows.show(found)
        print(f"{name}: {time.perf_counter() - start:.0f} s\n")
        rows += found
    if given.json is not None:
        _rows.write(rows, given.json)
    return rows


if __name__ == "__main__":
    main()

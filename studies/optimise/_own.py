"""Optimum of a user's actuator: `python -m studies optimise --actuator FILE.toml`."""

import dataclasses
from pathlib import Path
from typing import Any

from acausal.design import Design

from .._output import require_matplotlib, write_json
from .._own import Task


@dataclasses.dataclass(frozen=True)
class Value:
    """A variable or a result of an optimum, in SI units."""

    name: str
    value: float


def own(task: Task, json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> Design[Any]:
    """Optimise, print the design with its certificate, and write its values and a report."""
    if out is not None:
        require_matplotlib()
    design = task.solve(rtol)
    print(design)
    if json is not None:
        values = [Value(name, float(value)) for name, value in design.values.items()]
        results = [Value(one.limit.name, float(one.value)) for one in design.results]
        write_json(json, values, results=[Value(design.objective_name, float(design.objective)), *results])
    if out is not None:
        from .._report import write_report

        write_report(out, "optimise", "Your own actuator", [("The optimum", str(design), [design.plot()])], None)
    return design

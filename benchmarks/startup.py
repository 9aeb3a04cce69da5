"""What a user waits for: the first simulation and the first derivative in a fresh process, imports included."""

import subprocess
import sys
import time
from pathlib import Path

from ._effort import Effort
from ._rows import Row

LIMITS = {"first simulation": 5.0, "first forward derivative": 8.0}  # s
_SETUP = "import jax; from studies import opening_time; from studies.actuators import ema_maxon; "
_PROGRAMS = {
    "first simulation": "print(opening_time(ema_maxon()))",
    "first forward derivative": "print(jax.jvp(lambda r: opening_time(ema_maxon(ratio=r)), (4.3,), (1.0,)))",
}


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """The least of several fresh processes each."""
    rows = []
    for name, program in _PROGRAMS.items():
        seconds = min(_seconds(_SETUP + program) for _ in range(effort.processes))
        limit = LIMITS[name]
        rows.append(Row(f"compile: {name}", seconds, "s", f"limit: {limit:g} s", seconds / limit, 1.0))
    return rows


def _seconds(program: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)
    return time.perf_counter() - start

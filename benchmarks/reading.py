"""The cost of reading a run, beside the first run of its model: at other times, its peaks, integrals and energies.

CPU seconds in a process that finds nothing compiled; of each way to read, what it takes beyond a run that is compiled.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from ._effort import Effort
from ._rows import Row, compared

LIMIT = 0.25  # of the first run
_PROGRAM = """
import json, time
import jax
import numpy as np
from acausal import simulate
from benchmarks._press import press

model = press()
times = np.linspace(0.0, {end}, 2401)

def run(**options):
    return simulate(model, {end}, **dict(dict(max_steps=100_000), **options))

def seconds(function):
    start = time.process_time()
    jax.block_until_ready(jax.tree.leaves(function()))
    return time.process_time() - start

first = seconds(lambda: run(save="end").t1)
warm = min(seconds(lambda: run(save="end").t1) for _ in range(3))
ways = dict([
    ("another max_steps and max_events", lambda: run(save="end", max_steps=100_001, max_events=100).t1),
    ("all variables at all steps", lambda: run()["hose.b.p"]),
    ("all variables at 2,401 times", lambda: run(save=times)["hose.b.p"]),
    ("five peaks", lambda: run().peak(lambda s: [s.hose.b.p, s.hose.a.p, s.load.v, -s.load.v, s.work.f])),
    ("energies of all components", lambda: run().energy.imbalance),
])
beyond = dict((name, [seconds(way) - warm, min(seconds(way) for _ in range(2)) / warm]) for name, way in ways.items())
print(json.dumps([first, warm, beyond]))
"""


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """The first run, what each way to read takes beyond another one, and how long both take when all is compiled."""
    end = 2.4 if effort.processes > 1 else 0.1
    setting = {**os.environ, "ACAUSAL_CACHE": "off", "ACAUSAL_OPTIMISE": ""}
    command = [sys.executable, "-c", _PROGRAM.replace("{end}", str(end))]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=setting)
    first, warm, beyond = json.loads(done.stdout.splitlines()[-1])
    rows = [compared("press axis: first run", first, "s", warm, "a later run")]
    for name, (more, ratio) in beyond.items():
        rows.append(compared(f"press axis: {name}, first", more, "s", first, "the first run", LIMIT))
        rows.append(Row(f"press axis: {name}, later", ratio * warm, "s", "a run without", ratio, 2.0))
    return rows

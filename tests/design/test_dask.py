"""Sweeps on a real cluster of two processes, one of which is killed."""

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from _rigs import rig

from acausal import ArgumentError, simulate
from acausal.design import sweep

pytestmark = pytest.mark.slow
distributed = pytest.importorskip("distributed")
C = "link.c"
OVER = {C: np.linspace(40.0, 60.0, 2000)}


def first_passage(model: Any) -> Any:
    return simulate(model, 0.3, until=lambda s: s.link.s_rel, save="end", rtol=1e-8, throw=False)


def late(s: Any) -> Any:
    return s.t1


@pytest.mark.filterwarnings("ignore")  # of Dask, which tells that a worker is gone
def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of the pieces done, one of two workers is killed; the other one does what it has left behind."""
    zarr = pytest.importorskip("zarr")
    paths = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    store = tmp_path / "kept.zarr"
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        with pytest.raises(ArgumentError, match=r"For a client of Dask, use client.get_executor\(\)"):
            sweep(rig(), {C: [1.0]}, late, run=first_passage, executor=client)
        killed = []

        def kill() -> None:
            """Once half of the codes are written."""
            while not killed:
                time.sleep(0.02)
                files = store / "code" / "c"
                if files.exists() and len(list(files.iterdir())) >= 31:
                    killed.append(next(iter(client.run(os.getpid).values())))
                    os.kill(killed[0], signal.SIGKILL)

        thread = threading.Thread(target=kill, daemon=True)
        thread.start()
        found = sweep(
            rig(), OVER, {"time": late}, run=first_passage, store=store, chunk=32, executor=client.get_executor()
        )
        thread.join()
    assert killed
    assert np.all(np.asarray(zarr.open_group(store, mode="r")["code"][:]) == 0)
    here = sweep(rig(), {C: OVER[C][::200]}, {"time": late}, run=first_passage)
    np.testing.assert_allclose(found["time"].values[::200], here["time"], rtol=1e-12)

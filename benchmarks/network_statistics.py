"""CPU time and file size of the network federate's statistics, on the 41 s trip of G26.

Prints, for no series and for windows of several lengths, the CPU time of the network alone (30 PMUs
at 60 frames a second to 34 controllers, cross traffic, no grid) and the size of the two series.
The least of several repetitions counts: other work on the machine only ever adds to it.

    .venv/bin/python benchmarks/network_statistics.py
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tieline.cosim.interfaces import Clock, FrameBundle
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.network.federate import open_participant
from tieline.network.spec import FRAME_BYTES

WINDOWS_S = (None, 1.0, 0.1, 0.02)
REPETITIONS = 5


def cpu_s(run: dict[str, Any], folder: Path) -> float:
    """Return the CPU time of a run of the network, from the first frame to the last table."""
    clock = Clock(**run["clock"])
    payloads = np.zeros((len(run["sources"]), FRAME_BYTES), np.uint8)
    participant = open_participant(run, folder)
    begin_s = time.process_time()
    participant.start()
    since = 0
    for k in [*clock.meetings(), clock.intervals]:
        measured = (FrameBundle(clock.at_ns(i), payloads).to_bytes() for i in range(since, k + 1))
        participant.advance(k, b"".join(measured))
        since = k + 1
    participant.finish()
    return time.process_time() - begin_s


def main() -> None:
    """Measure and print."""
    run = dict(prepare(load_experiment("g26_trip", ["sweep=[]"])).runs[0].run)
    best: dict[float | None, float] = {}
    sizes: dict[float | None, int] = {}
    for _ in range(REPETITIONS):
        for window_s in WINDOWS_S:
            run["network"] = run["network"] | {"series_window": window_s}
            with TemporaryDirectory() as name:
                seconds = cpu_s(run, Path(name))
                files = Path(name).glob("*_series.parquet")
                sizes[window_s] = sum(path.stat().st_size for path in files)
            best[window_s] = min(seconds, best.get(window_s, np.inf))
    for window_s, seconds in best.items():
        more = 100 * (seconds / best[None] - 1)
        print(
            f"window {window_s or 'none':>5}: {seconds:6.2f} s CPU ({more:+5.1f} %),"
            f" series {sizes[window_s] / 1e6:5.2f} MB"
        )


if __name__ == "__main__":
    main()

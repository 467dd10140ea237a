"""Peak memory of recording every channel of a 40 s run of the miniWECC at 60 Hz.

Measured from the import of the libraries to the finished Parquet file, in this one process. The
first run on a machine compiles, which takes memory of its own: run it twice.
"""

import tempfile
from pathlib import Path

import numpy as np

from tieline.cosim.interfaces import DELIVERY, Clock, DeliveryBundle
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.grid.federate import open_participant

SETTINGS = (
    "sweep=null",
    "grid.duration=40 s",
    "network.engine=ideal",
    "wams.reporting=continuous",
)


def peak_mb() -> float:
    """Return the peak resident memory of this process so far, MB."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise OSError("/proc/self/status tells no peak memory")


def main() -> None:
    """Run the grid alone and print what each stage added."""
    run = dict(prepare(load_experiment("g26_trip", list(SETTINGS))).runs[0].run)
    clock = Clock(**run["clock"])
    nothing = np.empty(0, DELIVERY), np.empty((0, 0), np.uint8)
    peaks = {"libraries": peak_mb()}
    with tempfile.TemporaryDirectory() as folder:
        grid = open_participant(run, Path(folder))
        grid.start()
        peaks["compiled grid"] = peak_mb()
        for k in clock.meetings():
            until_ns = clock.at_ns(clock.next_meeting(k))
            grid.advance(k, DeliveryBundle(until_ns, *nothing).to_bytes())
        peaks["40 s recorded"] = peak_mb()
        grid.finish()
        peaks["table finished"] = peak_mb()
    for stage, peak in peaks.items():
        print(f"{stage:15} {peak:6.0f} MB, {peak - peaks['libraries']:4.0f} above the libraries")


if __name__ == "__main__":
    main()

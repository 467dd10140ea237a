"""How much faster two points at once are than one after another: a sweep of G26 trips.

The same points are run with one job and with two, alternately; wall time and processor time of the
whole command. Points are of 4 s, each with a delay of its own.

    .venv/bin/python benchmarks/sweep.py [--points 100] [--repeat 2] [--json FILE]
"""

import argparse
import os
import tempfile
from pathlib import Path

from startup import Sample, once

from figures import Row, save

SETTINGS = ("grid.duration=4 s", "grid.events=[{at: 1 s, trip_generator: G26}]")


def command(points: int, jobs: int) -> tuple[str, ...]:
    """Return the arguments of a sweep over delays from 150 ms on, one a millisecond."""
    delays = ", ".join(f"{150 + i} ms" for i in range(points))
    sweep = f"sweep={{method: grid, over: {{network.mean_delay: [{delays}]}}}}"
    settings = [word for setting in (*SETTINGS, sweep) for word in ("--set", setting)]
    return ("sweep", "g26_trip_smoke", "--jobs", str(jobs), "--quiet", *settings)


def rows_of(points: int, taken: dict[int, list[Sample]]) -> list[Row]:
    """Return the ratio of the wall times, and wall and processor time of either number of jobs."""
    what = f"sweep of {points} G26 runs of 4 s"
    ratios = [one[0] / two[0] for one, two in zip(taken[1], taken[2], strict=True)]
    rows = [Row(what, "wall time of one core over that of two", "", ratios, "at least", 1.8)]
    for jobs, samples in taken.items():
        walls, cpus = zip(*samples, strict=True)
        rows.append(Row(what, f"wall time, {jobs} at once", "s", walls))
        rows.append(Row(what, f"CPU time, {jobs} at once", "s", cpus))
    return rows


def main() -> None:
    """Measure, print, and write the rows where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--repeat", type=int, default=2)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    taken: dict[int, list[Sample]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as folder:
        # What is compiled for the first point must not count against either.
        once((*command(1, 1), "--out", f"{folder}/first"), os.environ)
        for number in range(options.repeat):
            for jobs, samples in taken.items():
                out = f"{folder}/{number}-{jobs}"
                samples.append(once((*command(options.points, jobs), "--out", out), os.environ))
    save(rows_of(options.points, taken), options.json)


if __name__ == "__main__":
    main()

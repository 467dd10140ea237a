"""How much faster two points at once are than one after another: a sweep of G26 trips.

The same points are run with one job and with two, alternately; wall time and processor time of the
whole command. Points are of 4 s, each with a delay of its own.

    .venv/bin/python benchmarks/sweep.py [--points 100] [--repeat 1] [--json FILE]
"""

import argparse
import json
import os
import statistics
import tempfile
from pathlib import Path

from startup import Sample, once

SETTINGS = ("grid.duration=4 s", "grid.events=[{at: 1 s, trip_generator: G26}]")


def command(points: int, jobs: int) -> tuple[str, ...]:
    """Return the arguments of a sweep over delays from 150 ms on, one a millisecond."""
    delays = ", ".join(f"{150 + i} ms" for i in range(points))
    sweep = f"sweep={{method: grid, over: {{network.mean_delay: [{delays}]}}}}"
    settings = [word for setting in (*SETTINGS, sweep) for word in ("--set", setting)]
    return ("sweep", "g26_trip_smoke", "--jobs", str(jobs), "--quiet", *settings)


def row(figure: str, unit: str, values: list[float], reach: str, points: int) -> dict:
    """Return one row of the table of figures."""
    return {
        "what": f"sweep of {points} G26 runs of 4 s",
        "figure": figure,
        "unit": unit,
        "reach": reach,
        "median": round(statistics.median(values), 3),
        "low": round(min(values), 3),
        "high": round(max(values), 3),
        "command": f"python benchmarks/sweep.py --points {points}",
        "peers": "",
    }


def main() -> None:
    """Measure, print, and write the rows where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--repeat", type=int, default=1)
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
    ratios = [one[0] / two[0] for one, two in zip(taken[1], taken[2], strict=True)]
    found = [row("wall time of one core by that of two", "1", ratios, "1.8", options.points)]
    for jobs, samples in taken.items():
        walls, cpus = ([sample[i] for sample in samples] for i in (0, 1))
        found.append(row(f"wall time, {jobs} at once", "s", walls, "", options.points))
        found.append(row(f"processor time, {jobs} at once", "s", cpus, "", options.points))
    for line in found:
        print(f"{line['figure']:40} {line['median']:8.2f} {line['unit']}")
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

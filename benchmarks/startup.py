"""How long it takes until something happens: help, a config error, a short run, the first run.

Each command is a process of its own, as a user starts it; wall time and the processor time of it
with all its children. A first run has an empty cache of compiled code.

    .venv/bin/python benchmarks/startup.py [--repeat 5] [--cold 3] [--json FILE]
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from figures import Row, save

RUNNER = Path(__file__).resolve().parent.parent / "runner.py"

SHORT = (
    "run",
    "g26_trip_smoke",
    "--core",
    "zmq",
    "--set",
    "grid.duration=1 s",
    "--set",
    "grid.events=[{at: 0.5 s, trip_generator: G26}]",
)
HELP = ("--help",)
WRONG = ("run", "g26_trip_smoke", "--set", "grid.lenght=1 s")

Sample = tuple[float, float]
"""Wall time and processor time, s."""


def once(arguments: Sequence[str], environment: Mapping[str, str], exit_code: int = 0) -> Sample:
    """Run the command once and return what it took.

    Raises:
        RuntimeError: it ended with another exit code.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin_s = time.perf_counter()
    done = subprocess.run(
        [sys.executable, str(RUNNER), *arguments],
        env=dict(environment),
        capture_output=True,
        check=False,
    )
    wall_s = time.perf_counter() - begin_s
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != exit_code:
        raise RuntimeError(done.stderr.decode())
    return wall_s, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def rows(what: str, samples: Sequence[Sample], reach: float | None = None) -> list[Row]:
    """Return two rows: wall time, which is to be at most `reach`, and processor time."""
    walls, cpus = zip(*samples, strict=True)
    return [
        Row(what, "wall time", "s", walls, "at most", reach),
        Row(what, "CPU time of all its processes", "s", cpus),
    ]


def measured(folder: Path, repeat: int, cold: int) -> list[Row]:
    """Return every row.

    Args:
        folder: empty; takes caches and results.
        repeat: times that each command runs with a filled cache.
        cold: times that the first run is done, each with an empty cache.
    """
    firsts = []
    environment = dict(os.environ)
    environment.pop("NUMBA_CACHE_DIR", None)
    # Where nobody turned that off, Python keeps the bytecode of what it has imported once.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    for number in range(cold):
        environment["XDG_CACHE_HOME"] = str(folder / f"cache{number}")
        firsts.append(once((*SHORT, "--out", str(folder / f"first{number}")), environment))
    if not cold:
        environment["XDG_CACHE_HOME"] = str(folder / "cache")
        once((*SHORT, "--out", str(folder / "first")), environment)
    shorts = [once((*SHORT, "--out", str(folder / f"run{i}")), environment) for i in range(repeat)]
    helps = [once(HELP, environment) for _ in range(repeat)]
    wrongs = [once(WRONG, environment, exit_code=2) for _ in range(repeat)]
    found = rows("run of 1 s, second time", shorts, 3.0)
    if firsts:
        found += rows("run of 1 s, very first, which compiles", firsts, 25.0)
    return found + rows("tieline --help", helps) + rows("mistake in a setting", wrongs)


def main() -> None:
    """Measure, print, and write the rows where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--cold", type=int, default=3)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = measured(Path(folder), options.repeat, options.cold)
    save(found, options.json)


if __name__ == "__main__":
    main()

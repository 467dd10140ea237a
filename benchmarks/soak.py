"""A soak: a long run of the miniWECC with cross traffic, repeated. Memory flat, hashes equal?

Looks once a second at the resident memory of every process of a run of `g26_trip` with a busy link,
and prints for each process what it held in the first and the second half of the simulated time
(without the first fifth, its warm-up), the slope of a straight line through it, and its peak up to
the end, when tables are made and drawn. Then once more, and the hashes of all tables are compared.

    .venv/bin/python benchmarks/soak.py                            30 simulated minutes, twice
    .venv/bin/python benchmarks/soak.py --minutes 5 --load 10      ten times what the link carries

The exit code is 1 if a process grew beyond the bounds below, or a table differs.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from tieline.cosim.interfaces import FEDERATES
from tieline.experiment.results import read_manifest
from tieline.logs import records

ROOT = Path(__file__).resolve().parents[1]

MOST_MB_PER_MINUTE = 0.5
"""Slope of a process's memory over simulated time that counts as flat."""

MOST_MB_MORE = 8.0
"""By how much its peak in the second half may exceed that of the first."""

LINK_MBIT_S = 20.0
WARM_UP = 0.2
PERIOD_S = 1.0

Sample = tuple[float, str, float]
"""Wall time (s since 1970), process, resident memory (MB)."""


@dataclass(frozen=True)
class Use:
    """What one process held, MB.

    Attributes:
        first_mb, second_mb: peak in each half of the simulated time after the warm-up.
        slope_mb_per_min: of a straight line through it, for a simulated minute.
        peak_mb: greatest up to the end of the process.
    """

    process: str
    first_mb: float
    second_mb: float
    slope_mb_per_min: float
    peak_mb: float

    @property
    def is_flat(self) -> bool:
        """Whether it stays within the bounds."""
        grown_mb = self.second_mb - self.first_mb
        return grown_mb <= MOST_MB_MORE and self.slope_mb_per_min <= MOST_MB_PER_MINUTE


def settings_of(minutes: float, load: float, core: str) -> list[str]:
    """Return the command line's settings of a run.

    Args:
        minutes: simulated.
        load: cross traffic over what the busy link carries.
        core: how the federates meet.
    """
    rate = f"{load * LINK_MBIT_S:g} Mbit/s"
    traffic = f"[{{kind: poisson, from: S101, to: S105, rate: {rate}, payload: 972}}]"
    settings = (
        f"grid.duration={60 * minutes:g} s",
        "sweep=null",
        "network.mean_delay=null",
        f"network.traffic={traffic}",
        f"federation.core={core}",
    )
    return [word for setting in settings for word in ("--set", setting)]


def sampled_run(folder: Path, settings: Sequence[str]) -> list[Sample]:
    """Run the experiment into a folder and return what was seen of its processes' memory.

    Raises:
        SystemExit: the run failed; its message is printed.
    """
    command = [sys.executable, str(ROOT / "runner.py"), "run", "g26_trip", "--quiet"]
    samples: list[Sample] = []
    command += ["--out", str(folder), *settings]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as run:
        while run.poll() is None:
            time.sleep(PERIOD_S)
            samples += [(time.time(), *seen) for pid in family(run.pid) if (seen := look(pid))]
        if run.returncode:
            raise SystemExit(run.returncode)
    return samples


def family(pid: int) -> list[int]:
    """Return a process and all that descend from it."""
    parents: dict[int, int] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = path.read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(path.parent.name)] = int(words[1])
    members = [pid]
    for member in members:
        members += [child for child, parent in parents.items() if parent == member]
    return members


def look(pid: int) -> tuple[str, float] | None:
    """Return a process's name and resident memory in MB; None if it has ended."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
        # A fork has its parent's command line and a name of its own.
        words += Path(f"/proc/{pid}/comm").read_text(encoding="ascii").split()
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return None
    module = next((word for word in words if re.match(r"tieline[.-]\w", word)), "launcher")
    return re.split(r"[.-]", module)[-1], pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def running(folder: Path) -> tuple[float, float]:
    """Return from when to when a run simulated, as its log tells it, wall time in s since 1970."""
    at = {
        record.message: datetime.fromisoformat(record.wall).timestamp()
        for record in records(folder)
        if record.event == "state"
    }
    # Without HELICS nobody leaves a federation, and a federate is finished at once.
    ends = [at.get(f"{name} is finishing") or at[f"{name} is finished"] for name in FEDERATES]
    return max(at[f"{name} is running"] for name in FEDERATES), min(ends)


def uses_of(samples: Sequence[Sample], since: float, until: float, minutes: float) -> list[Use]:
    """Return what each process held while the run simulated, from `since` to `until`."""
    begin = since + WARM_UP * (until - since)
    middle = (begin + until) / 2
    uses = []
    for name in sorted({process for _, process, _ in samples}):
        seen = np.array([(at, mb) for at, process, mb in samples if process == name])
        flat = seen[(seen[:, 0] >= begin) & (seen[:, 0] <= until)]
        if len(flat) < 4:
            continue
        minutes_at = (flat[:, 0] - since) / (until - since) * minutes
        slope = float(np.polyfit(minutes_at, flat[:, 1], 1)[0])
        is_first = flat[:, 0] < middle
        halves = [float(flat[part, 1].max(initial=0.0)) for part in (is_first, ~is_first)]
        uses.append(Use(name, *halves, slope, float(seen[:, 1].max())))
    return uses


def table(uses: Sequence[Use]) -> str:
    """Return the uses as text."""
    lines = [f"{'process':10} {'1st half':>9} {'2nd half':>9} {'slope':>12} {'peak':>9}"]
    lines += [
        f"{use.process:10} {use.first_mb:6.1f} MB {use.second_mb:6.1f} MB"
        f" {use.slope_mb_per_min:+5.2f} MB/min {use.peak_mb:6.1f} MB"
        f"  {'flat' if use.is_flat else 'GROWS'}"
        for use in uses
    ]
    return "\n".join(lines)


def main() -> None:
    """Run, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--minutes", type=float, default=30.0, help="simulated, of each run")
    parser.add_argument("--repeats", type=int, default=2, help="runs whose tables are compared")
    parser.add_argument("--load", type=float, default=0.6, help="cross traffic; 1: all that fits")
    parser.add_argument("--core", default="zmq", help="zmq, tcp, inproc or local")
    parser.add_argument("--json", action="store_true", help="print one object")
    asked = parser.parse_args()
    settings = settings_of(asked.minutes, asked.load, asked.core)
    answers: list[dict[str, Any]] = []
    hashes = []
    with tempfile.TemporaryDirectory(prefix="tieline-soak-") as place:
        for number in range(asked.repeats):
            folder = Path(place) / f"run{number}"
            begin_s = time.monotonic()
            samples = sampled_run(folder, settings)
            wall_s = time.monotonic() - begin_s
            uses = uses_of(samples, *running(folder), asked.minutes)
            stored_mb = sum(path.stat().st_size for path in folder.rglob("*.*")) / 1e6
            hashes.append(read_manifest(folder)["tables"])
            answers.append(
                {"wall_s": wall_s, "stored_mb": stored_mb, "uses": [asdict(use) for use in uses]}
                | {"is_flat": all(use.is_flat for use in uses)}
            )
            if not asked.json:
                print(f"run {number + 1}: {asked.minutes:g} min in {wall_s:.0f} s of wall time,")
                print(f"{stored_mb:.1f} MB stored\n{table(uses)}\n")
    is_equal = all(found == hashes[0] for found in hashes)
    if asked.json:
        print(json.dumps({"is_equal": is_equal, "tables": hashes[0], "runs": answers}, indent=2))
    elif len(hashes) > 1:
        same = "equal" if is_equal else "DIFFERENT"
        print(f"{len(hashes[0])} tables of {len(hashes)} runs: {same}")
    if not is_equal or not all(answer["is_flat"] for answer in answers):
        raise SystemExit(1)


if __name__ == "__main__":
    main()

"""The whole matrix of promise 4: equal hashes of all tables, however the federates meet.

    python tests/scenarios/same_bits.py --repeats 10 --json same_bits.json

Every repeat of every core has its own start order, stagger and random pauses in both federates,
and every second one has a single processor. The last line is of the same code without the compiler,
for 0.3 s, against the compiled one: counts and instants of packets must be equal, floating-point
columns within the tolerance that is printed.
"""

import argparse
import json
import os
import platform
import random
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from scenarios.study import run
from tieline.cosim.interfaces import FEDERATES
from tieline.experiment.launch import TOGETHER
from tieline.experiment.results import Run, read_runs

CORES = ("local", "inproc", "zmq", "tcp")
REFERENCE = "g26_trip_smoke"
SETTINGS = (
    "grid.events=[{at: 0.2 s, trip_generator: G26}]",
    "network.loss=0.01",
    "network.record_packets=true",
    "network.cross_traffic=1.5",
    "federation.hang_timeout=60 s",
    "federation.start_timeout=300 s",
    "seed=7",
)
PAUSING = Path(__file__).parent / "pausing.py"
TOLERANCE = 1e-10
SHORT_S = 0.3


def trial(core: str, number: int, duration_s: float, folder: Path) -> dict[str, Any]:
    """Run once; return its hashes and under which conditions they came about."""
    own = random.Random(f"{core} {number}")
    order = own.sample(FEDERATES, len(FEDERATES))
    allowed = sorted(os.sched_getaffinity(0))
    processors = allowed[:1] if number % 2 else allowed
    commands = {
        role: (sys.executable, str(PAUSING), str(100 * number), role)
        for role in (*FEDERATES, TOGETHER)
    }
    began = time.monotonic()
    os.sched_setaffinity(0, processors)
    try:
        result = run(
            REFERENCE,
            folder,
            f"grid.duration={duration_s} s",
            *SETTINGS,
            f"federation.core={core}",
            commands=commands,
            order=order,
            stagger_s=own.random(),
        )
    finally:
        os.sched_setaffinity(0, allowed)
    return {
        "core": core,
        "repeat": number,
        "first": order[0],
        "processors": len(processors),
        "wall_s": round(time.monotonic() - began, 1),
        "tables": dict(result.manifest["tables"]),
    }


def without_compiler(folder: Path) -> dict[str, float]:
    """Return, table by table, the largest difference between compiled and plain NumPy."""
    for name, compiler in (("on", "on"), ("off", "off")):
        words = [sys.executable, __file__, "--one", str(folder / name)]
        environment = os.environ | {"TIELINE_COMPILER": compiler}
        subprocess.run(words, env=environment, check=True, stdout=subprocess.DEVNULL)
    on, off = (read_runs(folder / name)[0] for name in ("on", "off"))
    return {name: _difference(on, off, name) for name in sorted(on.manifest["tables"])}


def _difference(one: Run, other: Run, table: str) -> float:
    """Return the largest difference of a table's columns of numbers.

    Raises:
        AssertionError: a column that counts, names or tells an instant of a packet differs.
    """
    left, right = (result.table(table.removesuffix(".parquet")) for result in (one, other))
    assert list(left.columns) == list(right.columns), table
    most = 0.0
    for name in left.columns:
        if left[name].dtype.kind == "f":
            gap = (left[name] - right[name]).abs().max()
            assert (left[name].isna() == right[name].isna()).all(), (table, name)
            most = max(most, 0.0 if gap != gap else float(gap))
        else:
            assert left[name].equals(right[name]), (table, name)
    return most


def one(folder: Path) -> None:
    """Run the short simulation in this process's state of the compiler."""
    run(REFERENCE, folder, f"grid.duration={SHORT_S} s", *SETTINGS, "federation.core=local")


def say(*words: str, file: TextIO = sys.stdout) -> None:
    """Write a line."""
    file.write(" ".join(words) + "\n")
    file.flush()


def save(path: Path | None, trials: list[dict[str, Any]], differences: dict[str, float]) -> None:
    """Write down what there is, if a file is given."""
    report = {"python": platform.python_version(), "trials": trials, "compiler_off": differences}
    if path is not None:
        path.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def main() -> int:
    """Run the matrix, print the table, and return 0 if every promise held."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--duration", type=float, default=2.0, help="simulated seconds")
    parser.add_argument("--json", type=Path, help="file for every hash")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one is not None:
        one(asked.one)
        return 0
    trials = []
    with TemporaryDirectory(prefix="same-bits-") as name:
        for number in range(asked.repeats):
            for core in CORES:
                folder = Path(name) / f"{core}-{number}"
                trials.append(trial(core, number, asked.duration, folder))
                is_equal = trials[-1]["tables"] == trials[0]["tables"]
                say("#", json.dumps(trials[-1] | {"tables": is_equal}), file=sys.stderr)
                save(asked.json, trials, {})
        differences = without_compiler(Path(name))
    save(asked.json, trials, differences)
    expected = trials[0]["tables"]
    say("| core | repeats | one processor | network first | equal to the first run |")
    say("|---|---|---|---|---|")
    for core in CORES:
        own = [made for made in trials if made["core"] == core]
        single = sum(made["processors"] == 1 for made in own)
        later = sum(made["first"] == "network" for made in own)
        same = sum(made["tables"] == expected for made in own)
        say(f"| {core} | {len(own)} | {single} | {later} | {same} |")
    worst = max(differences, key=lambda table: differences[table])
    most = differences[worst]
    say(f"\n{len(expected)} tables. Without the compiler, {SHORT_S} s: whole numbers equal,")
    say(f"largest difference of the others {most:.1e} ({worst}), allowed {TOLERANCE:.0e}.")
    is_equal = all(made["tables"] == expected for made in trials)
    return 0 if is_equal and most <= TOLERANCE else 1


if __name__ == "__main__":
    sys.exit(main())

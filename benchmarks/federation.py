"""A whole federation beside its two federates alone, in one run.

The 41 s trip of G26: 30 PMUs send 60 frames a second to 34 controllers each, with the cross traffic
of the case's network. The federation runs over zmq, in processes of its own. Every message that
the federates exchange is then recorded once, and each federate is run alone, in a process of its
own, on what the other sent it. Its time is that from the first message to the last table; the time
of the federation is that from the start of its first process to the end of its last. The whole
command also plans, checks, draws and writes the page.

    .venv/bin/python benchmarks/federation.py
"""

import argparse
import json
import pickle
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from figures import Row, save
from tieline.cosim.interfaces import GRID, NETWORK, Clock, OpenParticipant, Participant
from tieline.cosim.local import run_local
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare

RUNNER = Path(__file__).resolve().parent.parent / "runner.py"
WHOLE, SHARE, START_S, REAL_TIME, MEMORY_MB = "whole federation, zmq", 1.3, 2.0, 6.0, 350


def settings(seconds: float) -> list[str]:
    """Return what is changed of the experiment `g26_trip`."""
    return ["sweep=[]", f"grid.duration={seconds:g} s"]


def opener(name: str) -> OpenParticipant:
    """Return what opens a federate's participant."""
    if name == GRID:
        from tieline.grid.federate import open_participant
    else:
        from tieline.network.federate import open_participant
    return open_participant


class Heard:
    """A participant whose every incoming message is kept."""

    def __init__(self, participant: Participant) -> None:
        self.name = participant.name
        self.messages: list[tuple[int, bytes]] = []
        self.start, self.finish, self.abort = (
            participant.start,
            participant.finish,
            participant.abort,
        )
        self._advance: Callable[[int, bytes], bytes] = participant.advance

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the participant's answer."""
        self.messages.append((k, received))
        return self._advance(k, received)


def record(run: dict[str, Any], folder: Path) -> Path:
    """Return a file with what each federate is sent in the course of a run."""
    both = []
    for name in (GRID, NETWORK):
        (folder / name).mkdir()
        both.append(Heard(opener(name)(run, folder / name)))
    run_local(both[0], both[1], Clock(**run["clock"]))
    path = folder / "messages.pickle"
    path.write_bytes(pickle.dumps((run, {one.name: one.messages for one in both})))
    return path


def run_alone(name: str, path: Path) -> dict[str, float]:
    """Return what a federate costs on recorded messages, in this process."""
    run, messages = pickle.loads(path.read_bytes())
    with TemporaryDirectory() as folder:
        participant = opener(name)(run, Path(folder))
        began, began_cpu = time.perf_counter(), time.process_time()
        participant.start()
        for k, message in messages[name]:
            participant.advance(k, message)
        participant.finish()
        wall_s, cpu_s = time.perf_counter() - began, time.process_time() - began_cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
    return {"wall_s": wall_s, "cpu_s": cpu_s, "peak_mb": peak}


def alone(name: str, path: Path) -> dict[str, float]:
    """Return what a federate costs alone, in a process of its own."""
    command = [sys.executable, __file__, "--alone", name, str(path)]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(ran.stdout)
    return found


def whole(seconds: float, folder: Path) -> dict[str, Any]:
    """Return what the federation costs: wall time, and CPU time and memory of each process."""
    changes = [word for setting in settings(seconds) for word in ("--set", setting)]
    command = [sys.executable, str(RUNNER), "run", "g26_trip", *changes, "--out", str(folder)]
    began = time.perf_counter()
    subprocess.run(command, capture_output=True, text=True, check=True)
    wall_s = time.perf_counter() - began
    [path] = folder.rglob("manifest.json")
    manifest = json.loads(path.read_text(encoding="utf-8"))
    return {
        "command_s": wall_s,
        "wall_s": sum(manifest["times"]["phases_s"].values()),
        "cpu_s": manifest["times"]["cpu_s"],
        "phases_s": manifest["times"]["phases_s"],
        "peak_mb": {
            name: peak / 1e6 for name, peak in manifest["peak_memory_bytes"].items() if peak
        },
    }


def rows_of(
    seconds: float, federations: list[dict[str, Any]], parts: dict[str, list[dict[str, float]]]
) -> list[Row]:
    """Return the rows of several federations, and of as many runs of each part alone."""
    sums_s = [a["wall_s"] + b["wall_s"] for a, b in zip(parts[GRID], parts[NETWORK], strict=True)]
    walls_s = [one["wall_s"] for one in federations]
    over = [(wall_s - START_S) / sum_s for wall_s, sum_s in zip(walls_s, sums_s, strict=True)]
    rows = [
        Row(WHOLE, "wall time", "s", walls_s, "at most", seconds / REAL_TIME),
        Row(WHOLE, "times real time", "", [seconds / s for s in walls_s], "at least", REAL_TIME),
        Row(WHOLE, f"(wall - {START_S:g} s) / (grid + network)", "", over, "at most", SHARE),
    ]
    commands_s = [one["command_s"] for one in federations]
    rows.append(Row("whole command, with plan, figures and page", "wall time", "s", commands_s))
    for name, runs in parts.items():
        rows.append(Row(f"{name} alone", "wall time", "s", [one["wall_s"] for one in runs]))
        rows.append(Row(f"{name} alone", "CPU time", "s", [one["cpu_s"] for one in runs]))
    for name in federations[0]["cpu_s"]:
        cpu_s = [one["cpu_s"][name] for one in federations]
        rows.append(Row(WHOLE, f"CPU time of {name}", "s", cpu_s))
    for name in parts:
        peaks = [one["peak_mb"][name] for one in federations if name in one["peak_mb"]]
        rows.append(Row(WHOLE, f"peak memory of {name}", "MB", peaks, "at most", MEMORY_MB))
    return rows


def main() -> None:
    """Run everything as often as asked, in turn, after once for compilation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--duration", type=float, default=41.0, help="simulated time, s")
    parser.add_argument("--json", type=Path, help="file for the figures")
    parser.add_argument("--alone", nargs=2, metavar=("NAME", "FILE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        print(json.dumps(run_alone(options.alone[0], Path(options.alone[1]))))
        return
    planned = prepare(load_experiment("g26_trip", settings(options.duration))).runs[0]
    federations: list[dict[str, Any]] = []
    parts: dict[str, list[dict[str, float]]] = {GRID: [], NETWORK: []}
    with TemporaryDirectory() as name:
        folder = Path(name)
        path = record(dict(planned.run), folder)
        for number in range(options.repetitions):
            federations.append(whole(options.duration, folder / f"run{number}"))
            for part, runs in parts.items():
                runs.append(alone(part, path))
    save(rows_of(options.duration, federations, parts), options.json)


if __name__ == "__main__":
    main()

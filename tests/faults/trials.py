"""Harms runs of the miniWECC at random and tells whether every promise held.

    python tests/faults/trials.py --trials 50 --seed 1 --json trials.json

One run for each trial, two at a time; the seed draws fault, victim, phase, core and instant. The
exit code is 1 if a promise was broken. Trials of a full disk need a file system of their own: they
run where root may mount one in a name space of its own (`unshare`), and are left out elsewhere.
"""

import argparse
import collections
import json
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from faults.harness import harm
from faults.trial import VISITOR, Finding, Trial, write_guest

ROOT = Path(__file__).resolve().parents[2]
AT_ONCE = 2
DISK_MB = 12
LONG_S, SHORT_S = 60, 1
EXPERIMENT = """\
# How does a run end that is harmed?
name: harmed
question: How does a run end that is harmed?
case: miniwecc
grid: {{duration: {duration_s} s, events: [{{at: 0.5 s, trip_generator: G26}}]}}
federation:
  core: {core}
"""
PHASES = ("start", "running", "running", "running", "finishing", "whole")
IN_ONE = ("inproc", "local")
IN_SEVERAL = ("zmq", "tcp")
FAULTS = {
    "launcher": ("KILL", "KILL", "TERM", "INT", "INT INT"),
    "broker": ("KILL", "STOP", "TERM"),
    "grid": ("KILL", "STOP", "TERM", "FILE LIMIT"),
    "network": ("KILL", "STOP", "TERM"),
    "together": ("KILL", "STOP", "TERM", "FILE LIMIT"),
    VISITOR: ("KILL", "STOP", "TERM"),
    "keeper": ("KILL",),
}
_NAME_SPACE = "TIELINE_TRIALS_NAME_SPACE"


def drawn(number: int, seed: int, with_disk: bool) -> Trial:
    """Return trial `number` of a seed: kinds in turn, everything else at random."""
    draw = random.Random(f"{seed} {number}")
    kinds = [(fault, victim) for victim, faults in FAULTS.items() for fault in faults]
    kinds = [kind for kind in kinds if kind[1] != "keeper"]
    kinds += [("FULL DISK", "disk")] * 2 if with_disk else []
    random.Random(seed).shuffle(kinds)
    fault, victim = kinds[number % len(kinds)]
    cores = IN_ONE if victim == "together" else IN_SEVERAL
    if victim in ("launcher", "disk"):
        cores = (*IN_ONE, *IN_SEVERAL)
    core = "zmq" if victim == VISITOR else draw.choice(cores)
    phase = draw.choice(PHASES)
    if fault in ("FILE LIMIT", "FULL DISK"):
        phase = "running"
    latest_s = {"start": 4.0, "running": 3.0, "finishing": 0.5, "whole": 0.1}[phase]
    after_s = draw.uniform(0.0, latest_s)
    return Trial(fault, victim, phase, core, after_s, draw.random() < 0.3)


def attempt(trial: Trial, folder: Path, older: Path) -> Finding:
    """Return what came of a trial, made in a folder that this makes and removes."""
    folder.mkdir()
    is_on_disk = trial.fault == "FULL DISK"
    if is_on_disk:
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "none", str(folder)], check=True
        )
    try:
        is_short = trial.phase in ("finishing", "whole")
        text = EXPERIMENT.format(duration_s=SHORT_S if is_short else LONG_S, core=trial.core)
        if trial.victim == VISITOR or (trial.victim == "launcher" and trial.core == "zmq"):
            text += write_guest(folder)
        (folder / "harmed.yaml").write_text(text)
        if trial.has_older:
            shutil.copytree(older, folder / "out")
        command = [sys.executable, str(ROOT / "runner.py"), "run", "harmed.yaml", "--out", "out"]
        return harm(trial, command, folder)
    finally:
        if is_on_disk:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)
        shutil.rmtree(folder, ignore_errors=True)


def made_older(folder: Path) -> Path:
    """Return a whole result, which also has everything compiled before the first trial."""
    text = EXPERIMENT.format(duration_s=SHORT_S, core="zmq")
    (folder / "older.yaml").write_text(text)
    command = [sys.executable, str(ROOT / "runner.py"), "run", "older.yaml", "--out", "older"]
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"a run that nobody harms fails here: {done.stderr}")
    manifest = json.loads((folder / "older" / "manifest.json").read_text())
    (folder / "older" / "manifest.json").write_text(json.dumps(manifest | {"label": "older"}))
    return folder / "older"


def table(findings: Sequence[Finding]) -> str:
    """Return the table of what was found, a row for each kind of fault.

    `busy` is how many processes of all users wanted to run on each core, on average.
    """
    kinds = collections.defaultdict(list)
    for finding in findings:
        kinds[finding.trial.kind].append(finding)
    rows = ["| fault | trials | worst to end, s | median, s | worst to clean, s | busy | held |"]
    rows.append("|---|---|---|---|---|---|---|")
    for kind, found in [*sorted(kinds.items()), ("all", list(findings))]:
        # A run that was whole already goes on to its plots.
        ends = [one.end_s for one in found if one.status != "complete"] or [0.0]
        held = sum(not one.broken for one in found)
        rows.append(
            f"| {kind} | {len(found)} | {max(ends):.1f} | {statistics.median(ends):.1f} |"
            f" {max(one.clean_s for one in found):.1f} |"
            f" {statistics.mean(one.busy for one in found):.1f} | {held} of {len(found)} |"
        )
    return "\n".join(rows)


def main(argv: Sequence[str] | None = None) -> int:
    """Return 0 if every promise held in every trial."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    parser.add_argument("--at-once", type=int, default=AT_ONCE)
    parser.add_argument("--json", type=Path, metavar="FILE")
    arguments = parser.parse_args(argv)
    with_disk = _NAME_SPACE in os.environ
    if not with_disk and _may_mount():
        again = [sys.executable, *(sys.argv if argv is None else [__file__, *argv])]
        os.execvpe(
            "unshare",
            ["unshare", "--mount", "--propagation", "private", *again],
            {**os.environ, _NAME_SPACE: "1"},
        )
    if not with_disk:
        say("no trial of a full disk: that needs root, to mount a small one")
    begin_s = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="tieline-trials-") as name:
        findings = _all(Path(name), arguments, with_disk)
    say(table(findings))
    say(f"{len(findings)} trials in {time.monotonic() - begin_s:.0f} s of wall time")
    return 1 if any(one.broken for one in findings) else 0


def _all(folder: Path, arguments: argparse.Namespace, with_disk: bool) -> list[Finding]:
    older = made_older(folder)
    done: list[Finding] = []

    def one(number: int) -> Finding:
        trial = drawn(number, arguments.seed, with_disk)
        finding = attempt(trial, folder / f"trial-{number}", older)
        verdict = "; ".join(finding.broken) or "held"
        done.append(finding)
        if arguments.json is not None:
            text = json.dumps([asdict(one) for one in done], indent=2)
            arguments.json.write_text(text + "\n", encoding="utf-8")
        say(
            f"{number}: {trial.kind}, {trial.phase} + {trial.after_s:.2f} s, {trial.core}:"
            f" {finding.end_s:.1f} s, exit code {finding.exit_code}, {finding.status}"
            f" ({finding.reason.splitlines()[0] if finding.reason else '-'}): {verdict}"
        )
        return finding

    numbers = range(arguments.first, arguments.first + arguments.trials)
    with ThreadPoolExecutor(arguments.at_once) as pool:
        return list(pool.map(one, numbers))


def _may_mount() -> bool:
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        return False
    command = ["unshare", "--mount", "true"]
    return subprocess.run(command, check=False, capture_output=True).returncode == 0


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())

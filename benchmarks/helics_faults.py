"""What each fault does to plain HELICS federates, and to tieline's, beside `tieline run`.

    .venv/bin/python benchmarks/helics_faults.py --json faults.json

Three ways to run: two plain Python federates under `helics run`, the files of `tieline
export-helics` under `helics run`, and `tieline run`. The first two have HELICS's own supervision,
the last tieline's. Each fault is injected once the federates exchange messages; from then on it is
measured how long any process of the run lives, with which code the launcher ends, whether what it
prints names the culprit, which processes outlive it, and whether it claims success. A full disk is
a file system of 24 MB in memory, which takes root to mount.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import helics
import psutil
from helics_ways import INJECT, PROGRAMS, WAYS, Way

CAP_S, START_S = 60.0, 240.0
LONG_S, SHORT_S = 400, 4
MARK = "HELICS_FAULTS_RUN"


@dataclass
class Result:
    """What a fault led to.

    Attributes:
        ended_s: until the last process had ended, None if some ran on at the cap.
        exit_code: the launcher's, None if it ran on.
        names_culprit: whether the launcher's output names the federate or process at fault.
        orphans: processes that lived 2 s after the launcher had ended.
        claims_success: whether exit code or manifest says that all is well.
        last_words: end of the launcher's output.
    """

    ended_s: float | None
    exit_code: int | None
    names_culprit: bool
    orphans: list[str]
    claims_success: bool
    last_words: str = ""


@dataclass
class Trial:
    """A federation under way: its launcher, and its processes by the mark they inherit."""

    way: Way
    folder: Path
    port: int
    launcher: subprocess.Popen[bytes]
    mark: str

    def members(self) -> list[psutil.Process]:
        """Return every living process of the run."""
        found = []
        for process in psutil.process_iter():
            try:
                is_own = process.environ().get(MARK) == self.mark
                if is_own and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
            except psutil.Error:
                continue
        return found

    def find(self, word: str) -> psutil.Process:
        """Return the process whose command line holds a word."""
        for process in self.members():
            words = process.cmdline()
            if process.pid != self.launcher.pid and any(word in part for part in words):
                return process
        raise RuntimeError(f"no process with {word} in {self.way.name}")

    def signal(self, word: str, number: int) -> None:
        """Send a signal to one of them."""
        self.find(word).send_signal(number)


def fill_disk(trial: Trial) -> None:
    """Leave no room in the file system of the folder."""
    with (trial.folder / "filler").open("wb", buffering=0) as filler:
        try:
            while True:
                filler.write(bytes(1 << 12))
        except OSError:
            pass


FAULTS: dict[str, tuple[str, Callable[[Trial], None]]] = {
    "exception in a federate": ("victim", lambda t: t.signal(t.way.victim[0], signal.SIGUSR1)),
    "SIGKILL of a federate": ("victim", lambda t: t.signal(t.way.victim[0], signal.SIGKILL)),
    "SIGSTOP of a federate": ("victim", lambda t: t.signal(t.way.victim[0], signal.SIGSTOP)),
    "SIGTERM to a federate": ("victim", lambda t: t.signal(t.way.victim[0], signal.SIGTERM)),
    "SIGKILL of the broker": ("broker", lambda t: t.signal(t.way.broker, signal.SIGKILL)),
    "SIGKILL of the launcher": ("", lambda t: t.launcher.kill()),
    "a federate never starts": ("other", lambda t: None),
    "full disk": ("any", fill_disk),
    "Ctrl-C": ("", lambda t: os.killpg(t.launcher.pid, signal.SIGINT)),
    "leftover broker on the port": ("", lambda t: None),
    "malformed messages": ("", lambda t: None),
}
SHORT = ("leftover broker on the port", "malformed messages")


def culprits(way: Way, who: str) -> list[str]:
    """Return words of which one names the culprit."""
    if not who:
        return []
    if who == "broker":
        return ["broker: ", "Process broker has failed"]
    names = {"victim": (way.victim[1],), "other": (way.other[1],)}.get(
        who, (way.victim[1], way.other[1], "launcher")
    )
    return [word for name in names for word in (f"{name}: ", f"Process {name} has failed")]


def measured(way: Way, fault: str) -> Result:
    """Run a federation, inject a fault, and return what came of it."""
    who, inject = FAULTS[fault]
    with TemporaryDirectory(prefix="helics-faults-") as name:
        folder = Path(name)
        if fault == "full disk":
            subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24m", "tmpfs", name], check=True)
        try:
            return _measured(way, fault, folder, who, inject)
        finally:
            if fault == "full disk":
                subprocess.run(["umount", "--lazy", name], check=True)


def _measured(
    way: Way, fault: str, folder: Path, who: str, inject: Callable[[Trial], None]
) -> Result:
    port = random.SystemRandom().randrange(10_000, 32_000, 50)
    command = way.prepare(
        folder, port, SHORT_S if fault in SHORT else LONG_S, fault == "malformed messages"
    )
    mark = uuid.uuid4().hex
    paths = [str(INJECT), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {MARK: mark, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    environment["PYTHONUNBUFFERED"] = "1"
    if fault == "a federate never starts":
        environment["INJECT_NEVER"] = way.other[0]
    leftover = None
    if fault == "leftover broker on the port":
        words = [f"{PROGRAMS}/helics_broker", "-f", "2", f"--port={port}"]
        quiet = subprocess.DEVNULL
        leftover = subprocess.Popen(words, stdout=quiet, stderr=quiet, start_new_session=True)
        time.sleep(2)
    # Its output goes where the disk is not full.
    with TemporaryDirectory() as beside:
        said = Path(beside) / "said"
        with said.open("wb") as output:
            launcher = subprocess.Popen(
                command,
                cwd=folder,
                env=environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        trial = Trial(way, folder, port, launcher, mark)
        try:
            if fault not in (*SHORT, "a federate never starts"):
                _await_under_way(trial)
            began = time.monotonic()
            inject(trial)
            # A whole run, where nothing need go wrong, may take its time on a busy computer.
            cap_s = 5 * CAP_S if fault in SHORT else CAP_S
            return _observed(trial, began, culprits(way, who), said, cap_s)
        finally:
            for process in trial.members():
                process.kill()
            launcher.wait()
            if leftover is not None:
                os.killpg(leftover.pid, signal.SIGKILL)
                leftover.wait()


def _await_under_way(trial: Trial) -> None:
    limit = time.monotonic() + START_S
    while not trial.way.is_under_way(trial.folder):
        if time.monotonic() > limit or trial.launcher.poll() is not None:
            raise RuntimeError(f"{trial.way.name} did not get under way")
        time.sleep(0.2)
    time.sleep(4)


def _observed(trial: Trial, began: float, names: list[str], said: Path, cap_s: float) -> Result:
    ended_s, launcher_s = None, None
    orphans: list[str] = []
    while time.monotonic() < began + cap_s:
        is_over = trial.launcher.poll() is not None
        now = time.monotonic()
        if is_over and launcher_s is None:
            launcher_s = now
        alive = trial.members()
        if launcher_s is not None and now > launcher_s + 2 and not orphans:
            orphans = [_word(process) for process in alive]
        if is_over and not alive:
            ended_s = now - began
            break
        time.sleep(0.1)
    text = said.read_text(errors="replace")
    code = trial.launcher.poll()
    manifest = next(trial.folder.rglob("manifest.json"), None)
    whole = False
    if manifest is not None:
        whole = json.loads(manifest.read_text())["status"] == "complete"
    return Result(
        None if ended_s is None else round(ended_s, 1),
        code,
        any(name in text for name in names),
        orphans,
        code == 0 or whole,
        text[-6000:],
    )


def _word(process: psutil.Process) -> str:
    try:
        parts = process.cmdline()
    except psutil.Error:
        return "gone"
    return next(
        (Path(part).name for part in parts[1:] if "tieline." in part or ".py" in part),
        Path(parts[0]).name if parts else "?",
    )


def cell(result: Result, fault: str) -> str:
    """Return what the table says of a result."""
    who = FAULTS[fault][0]
    time_s = f"still running after {CAP_S:g} s" if result.ended_s is None else f"{result.ended_s} s"
    parts = [time_s, "-" if result.exit_code is None else f"exit {result.exit_code}"]
    if who:
        parts.append("named" if result.names_culprit else "**not named**")
    if result.orphans:
        parts.append(f"**left: {', '.join(result.orphans)}**")
    if result.claims_success and fault not in SHORT:
        parts.append("**claims success**")
    return ", ".join(parts)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="file for every figure")
    parser.add_argument("--fault", action="append", choices=list(FAULTS), help="only this one")
    parser.add_argument("--table", action="append", type=Path, help="only print these figures")
    asked = parser.parse_args()
    # A shell's background jobs ignore Ctrl-C, and hand that on to what they start.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if asked.table:
        told = {}
        for path in asked.table:
            told |= json.loads(path.read_text())
        show({name: [Result(**r) for r in told[name]] for name in FAULTS if name in told})
        return
    faults = asked.fault or list(FAULTS)
    table: dict[str, list[Result]] = {}
    # The three ways at once: what is waited for is mostly patience.
    with ThreadPoolExecutor(len(WAYS)) as pool:
        for fault in faults:
            table[fault] = list(pool.map(lambda way, fault=fault: measured(way, fault), WAYS))
            print("#", fault, [cell(result, fault) for result in table[fault]], file=sys.stderr)
            if asked.json:
                data = {name: [asdict(r) for r in row] for name, row in table.items()}
                asked.json.write_text(json.dumps(data, indent=2) + "\n")
    show(table)


def show(table: dict[str, list[Result]]) -> None:
    """Print a Markdown table."""
    print(f"HELICS {helics.helicsGetVersion()}, Python {sys.version.split()[0]}\n")
    print("| fault |", " | ".join(way.name for way in WAYS), "|")
    print("|---|" + "---|" * len(WAYS))
    for fault, row in table.items():
        print(f"| {fault} |", " | ".join(cell(result, fault) for result in row), "|")


if __name__ == "__main__":
    main()

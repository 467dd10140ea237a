"""The three ways in which `helics_faults.py` runs a federation of two."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAIR, INJECT = HERE / "helics_pair", HERE / "helics_pair" / "inject"
RUNNER = HERE.parent / "runner.py"
PROGRAMS = Path(sys.executable).parent


@dataclass
class Way:
    """One way to run a federation of two.

    Attributes:
        name: as the table has it.
        prepare: (folder, port, seconds, stranger) returns the launcher's command.
        victim: what the command line of the federate holds that is hurt, and its name in messages.
        other: the same of the one that never starts.
        broker: what the broker's command line holds.
        is_under_way: whether the federates of a folder exchange messages.
    """

    name: str
    prepare: Callable[[Path, int, int, bool], list[str]]
    victim: tuple[str, str]
    other: tuple[str, str]
    broker: str
    is_under_way: Callable[[Path], bool]


def plain(folder: Path, port: int, seconds: int, stranger: bool) -> list[str]:
    """Write a runner file for the plain pair."""
    python = sys.executable
    commands = {
        "broker": f"{PROGRAMS}/helics_broker -f {3 if stranger else 2} --port={port}",
        "sender": f"{python} {PAIR}/sender.py {port} {seconds}",
        "receiver": f"{python} {PAIR}/receiver.py {port} {seconds}",
    }
    if stranger:
        commands["stranger"] = f"{python} {PAIR}/stranger.py {port} inbox"
    federates = [
        {"name": name, "host": "localhost", "directory": ".", "exec": command}
        for name, command in commands.items()
    ]
    (folder / "runner.json").write_text(
        json.dumps({"name": "pair", "broker": False, "federates": federates})
    )
    return [f"{PROGRAMS}/helics", "run", "--path=runner.json"]


def settings(folder: Path, seconds: int, stranger: bool) -> list[str]:
    """Write an experiment and return how to run it for some simulated seconds."""
    guest = ""
    if stranger:
        command = f"{sys.executable} {PAIR}/stranger.py {{config}} grid/modulation"
        guest = f"federation: {{guests: [{{name: stranger, command: '{command}', units: [G34]}}]}}"
    (folder / "faults.yaml").write_text(
        "name: faults\nquestion: What does each fault do?\ncase: miniwecc\n"
        f"grid: {{duration: {seconds} s}}\nwams: {{reporting: 60}}\n{guest}\n"
    )
    return [
        str(folder / "faults.yaml"),
        "--set",
        "network.engine=constant",
        "--set",
        "network.delay=100 ms",
    ]


def exported(folder: Path, port: int, seconds: int, stranger: bool) -> list[str]:
    """Write tieline's files for `helics run`, their processes with the injector."""
    words = ["export-helics", *settings(folder, seconds, stranger), "--port", str(port)]
    subprocess.run(
        [sys.executable, RUNNER, *words, "--out", folder / "helics"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    path = folder / "helics" / "runner.json"
    runner = json.loads(path.read_text())
    for federate in runner["federates"]:
        own = federate["env"].get("PYTHONPATH", "")
        federate["env"]["PYTHONPATH"] = f"{INJECT}{os.pathsep}{own}"
    path.write_text(json.dumps(runner))
    return [f"{PROGRAMS}/helics", "run", f"--path={path}"]


def ours(folder: Path, port: int, seconds: int, stranger: bool) -> list[str]:
    """Return the command of `tieline run`."""
    words = ["run", *settings(folder, seconds, stranger), "--out", str(folder / "result")]
    return [sys.executable, str(RUNNER), *words]


def grows(folder: Path, pattern: str, least: int = 1) -> bool:
    """Return whether a file of a folder has come to be, of some size."""
    return any(path.stat().st_size >= least for path in folder.rglob(pattern) if path.exists())


WAYS = (
    Way(
        "plain federates, `helics run`",
        plain,
        ("sender.py", "sender"),
        ("receiver.py", "receiver"),
        "helics_broker",
        lambda f: grows(f, "receiver.csv", 500),
    ),
    Way(
        "tieline's, `helics run`",
        exported,
        ("tieline.grid", "grid"),
        ("tieline.network", "network"),
        "helics_broker",
        lambda f: grows(f, ".streams.json.part") or grows(f, "streams.json"),
    ),
    Way(
        "`tieline run`",
        ours,
        ("tieline.grid", "grid"),
        ("tieline.network", "network"),
        "tieline.cosim.broker",
        lambda f: grows(f, "streams.json"),
    ),
)

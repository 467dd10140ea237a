"""The checks of `tieline doctor`, one function each."""

import importlib.metadata
import importlib.util
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tieline
from tieline.cosim.ports import reserved_port
from tieline.errors import TielineError
from tieline.experiment.supervise import child_environment
from tieline.resources import shipped
from tieline.sweeps.local import available_bytes, cores

Level = Literal["ok", "warn", "fail"]

HELICS = "3.6.1"
"""The release whose behaviour the time contract rests on."""

PYTHONS = ((3, 11), (3, 13))
FREE_BYTES = 1_000_000_000
EXTRAS = {
    "ns3": ("ns3", "network.engine ns3"),
    "dask": ("distributed", "tieline sweep --scheduler"),
}
"""Module of each optional extra, and what needs it."""

FEDERATION = "g26_trip_smoke"
FEDERATION_SETTINGS = ("grid.duration=2 s", "federation.core=zmq")

_CACHE_QUERY = """
import json
from tieline.compiled import IS_ON, cached
folder, count = cached()
print(json.dumps({"is_on": IS_ON, "folder": folder and str(folder), "count": count}))
"""


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        name: what was looked at.
        level: `ok`; `warn` where something is missing that not all need; `fail`.
        text: what was found.
        advice: what to do about it; empty where nothing needs doing.
    """

    name: str
    level: Level
    text: str
    advice: str = ""


Check = Callable[[], Finding]


def examine(checks: Sequence[Check]) -> Iterator[Finding]:
    """Yield what each check finds, as it finds it."""
    for check in checks:
        yield check()


def python_version() -> Finding:
    """Check the version of Python."""
    version = platform.python_version()
    first, last = PYTHONS
    text = f"{version} ({sys.executable})"
    if first <= sys.version_info[:2] <= last:
        return Finding("Python", "ok", text)
    advice = f"use Python {_dotted(first)} to {_dotted(last)}"
    return Finding("Python", "fail", text, advice)


def installation() -> Finding:
    """Check that tieline's own files are here."""
    where = Path(tieline.__file__).resolve().parent
    try:
        configs, cases = shipped("configs"), shipped("cases")
    except TielineError as error:
        return Finding("tieline", "fail", str(error), "install tieline again")
    counts = len(list(configs.glob("*.yaml"))), len(list(cases.glob("*/case.yaml")))
    text = f"{tieline.__version__} in {where}, {counts[0]} experiments, {counts[1]} cases"
    if not all(counts):
        return Finding("tieline", "fail", text, "install tieline again")
    return Finding("tieline", "ok", text)


def processors() -> Finding:
    """Check how many cores there are for grid and network, and for sweeps."""
    count = cores()
    text = f"{count} that this process may use: a sweep runs as many points at once"
    if count >= 2:
        return Finding("cores", "ok", text)
    return Finding("cores", "warn", text, "grid and network take turns on one core")


def memory() -> Finding:
    """Check the memory that new processes can have."""
    free = available_bytes()
    if free is None:
        return Finding("memory", "warn", "this system does not tell how much is free")
    text = f"{free / 1e9:.1f} GB free"
    if free >= FREE_BYTES:
        return Finding("memory", "ok", text)
    return Finding("memory", "warn", text, "a run over zmq takes up to 0.7 GB: end other programs")


def helics_version() -> Finding:
    """Check that HELICS is the release that tieline was made for."""
    try:
        version = importlib.metadata.version("helics")
    except importlib.metadata.PackageNotFoundError:
        advice = f"pip install helics=={HELICS}; until then only --core local works"
        return Finding("HELICS", "fail", "not installed", advice)
    if version == HELICS:
        return Finding("HELICS", "ok", version)
    advice = f"the time contract was tested with {HELICS}: pip install helics=={HELICS}"
    return Finding("HELICS", "warn", version, advice)


def compiled_code() -> Finding:
    """Check that compiled code can be kept, and whether there is any."""
    query = [sys.executable, "-c", _CACHE_QUERY]
    done = subprocess.run(
        query, capture_output=True, text=True, check=False, env=child_environment()
    )
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:]
        return Finding("compiled code", "fail", " ".join(last), "install tieline again")
    found = json.loads(done.stdout)
    if not found["is_on"]:
        advice = "unset TIELINE_COMPILER: without compiling a run takes some 50 times as long"
        return Finding("compiled code", "warn", "compiling is switched off", advice)
    folder = found["folder"]
    if folder is None or not os.access(folder, os.W_OK):
        advice = "set XDG_CACHE_HOME to a folder that can be written: each run compiles anew"
        return Finding("compiled code", "warn", f"no cache can be written ({folder})", advice)
    text = f"{found['count']} functions in {folder}"
    advice = "" if found["count"] else "nothing to do: the first run compiles for some two minutes"
    return Finding("compiled code", "ok" if found["count"] else "warn", text, advice)


def ports() -> Finding:
    """Check that a block of loopback ports can be had."""
    try:
        with reserved_port() as port:
            return Finding("ports", "ok", f"a free block on 127.0.0.1, such as from {port} on")
    except TielineError as error:
        advice = "let programs listen on 127.0.0.1; until then --core inproc works"
        return Finding("ports", "fail", str(error), advice)


def extra(name: str) -> Finding:
    """Check whether an optional extra is installed."""
    module, purpose = EXTRAS[name]
    if importlib.util.find_spec(module) is None:
        advice = f"only for {purpose}: pip install 'tieline[{name}]'"
        return Finding(f"extra {name}", "ok", "not installed", advice)
    return Finding(f"extra {name}", "ok", f"{module} {importlib.metadata.version(module)}")


def federation() -> Finding:
    """Run two seconds of the miniWECC over zmq, and check that the result is whole."""
    # With the plan come the case's readers, which the other checks should not wait for.
    from tieline.experiment.launch import launch
    from tieline.experiment.load import load_experiment
    from tieline.experiment.plan import prepare
    from tieline.experiment.results import read_manifest
    from tieline.experiment.run import execute

    name = "federation"
    try:
        plan = prepare(load_experiment(FEDERATION, FEDERATION_SETTINGS))
        with tempfile.TemporaryDirectory() as folder:
            manifest = read_manifest(execute(plan, Path(folder) / "run", launch))
    except TielineError as error:
        advice = f"tieline run {FEDERATION} --debug, then tieline doctor --last"
        return Finding(name, "fail", str(error).splitlines()[0], advice)
    wall_s = manifest["times"]["wall_s"]
    return Finding(name, "ok", f"broker, grid and network over zmq: 2 s in {wall_s:.1f} s")


def _dotted(version: tuple[int, int]) -> str:
    return ".".join(map(str, version))


def ns3_extra() -> Finding:
    """Check the extra ns3."""
    return extra("ns3")


def dask_extra() -> Finding:
    """Check the extra dask."""
    return extra("dask")


CHECKS: tuple[Check, ...] = (
    python_version,
    installation,
    processors,
    memory,
    helics_version,
    compiled_code,
    ports,
    ns3_extra,
    dask_extra,
    federation,
)
"""In the order in which they are shown; the last one takes seconds."""

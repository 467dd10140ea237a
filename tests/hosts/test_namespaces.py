"""One run over three network stacks, joined by lines that take 5 ms.

broker   10.213.77.1 --+
grid     10.213.77.2 --+-- each frame 5 ms later
network  10.213.77.3 --+
"""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from hosts.namespaces import command_in, hosts, why_not
from scenarios.study import run
from tieline.experiment.gather import gather
from tieline.experiment.keys import KEY_VARIABLE
from tieline.experiment.results import Run, read_runs

RUNNER = str(Path(__file__).parents[2] / "runner.py")
REFERENCE = "g26_trip_smoke"
SHORT = ("grid.duration=1 s", "grid.events=[{at: 0.2 s, trip_generator: G26}]")
DELAY_MS = 5.0
PORT = "23404"
REASON = why_not()

pytestmark = [pytest.mark.helics, pytest.mark.netns, pytest.mark.slow]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    result = run(REFERENCE, tmp_path_factory.mktemp("here") / "r", *SHORT, "federation.core=local")
    return dict(result.manifest["tables"])


@pytest.fixture(scope="module")
def addresses() -> Iterator[Mapping[str, str]]:
    if REASON is not None:
        pytest.skip(REASON)
    with hosts(["broker", "grid", "network"], DELAY_MS) as given:
        yield given


def start(where: str, *words: str) -> "subprocess.Popen[str]":
    command = command_in(where, sys.executable, RUNNER, words[0], REFERENCE, *words[1:])
    for setting in SHORT:
        command += ["--set", setting]
    output = subprocess.PIPE
    environment = os.environ | {KEY_VARIABLE: "a key for three hosts"}
    return subprocess.Popen(
        command, stdout=output, stderr=subprocess.STDOUT, text=True, env=environment
    )


@pytest.mark.parametrize("core", ["zmq", "tcp"])
def test_three_hosts_give_the_bits_of_one(
    core: str, expected: dict[str, str], addresses: Mapping[str, str], tmp_path: Path
) -> None:
    """A result that depended on where its federates ran could not be repeated elsewhere."""
    broker = addresses["broker"]
    how = ("--allow-remote", "--set", f"federation.core={core}")
    sides = {"broker": start("broker", "broker", "--host", broker, "--port", PORT, *how)}
    for name in ("grid", "network"):
        place = ("--broker", f"{broker}:{PORT}", "--out", str(tmp_path / name))
        sides[name] = start(name, "join", "--federate", name, *place, *how)
    said = {name: side.communicate(timeout=120)[0] for name, side in sides.items()}
    assert {name: side.returncode for name, side in sides.items()} == dict.fromkeys(sides, 0), said
    assert f"grid comes from {addresses['grid']}" in said["broker"]
    result: Run = read_runs(gather([tmp_path / "grid", tmp_path / "network"], tmp_path / "result"))[
        0
    ]
    assert result.is_complete
    assert dict(result.manifest["tables"]) == expected
    settings = result.manifest["granted_ns"]
    assert settings["grid"] == settings["network"] > 1_000_000_000


def test_the_lines_between_the_hosts_do_delay(addresses: Mapping[str, str]) -> None:
    """If not, the test above would be one of a single host."""
    program = (
        "import socket, time, sys\n"
        "began = time.monotonic()\n"
        "try:\n    socket.create_connection((sys.argv[1], 9), timeout=5)\n"
        "except ConnectionRefusedError:\n    print(time.monotonic() - began)\n"
    )
    command = command_in("grid", sys.executable, "-c", program, addresses["network"])
    took_s = float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert took_s >= 2 * DELAY_MS / 1e3

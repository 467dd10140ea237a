"""A fault inside tieline ends the run with its name and time; nothing of it looks whole."""

import sys
from pathlib import Path

import pytest

from scenarios.study import run
from tieline.errors import CosimError, NumericalError
from tieline.experiment.results import read_manifest
from tieline.experiment.run import RunFailedError

SPOILT = Path(__file__).with_name("spoilt.py")
SETTINGS = (
    "federation.core=local",
    "federation.hang_timeout=120 s",
    "grid.duration=0.4 s",
    "grid.events=[]",
)


@pytest.mark.parametrize(
    ("way", "code", "words"),
    [
        (
            "miscount",
            CosimError.exit_code,
            r"network: the network lost count of packets at 200000000 ns: \d+ sent, but \d+ "
            r"delivered, .* dropped at queues, .* and \d+ in flight",
        ),
        (
            "lost statistics",
            CosimError.exit_code,
            r"network: flow 0 has more packets ended than sent at 200000000 ns: 10 sent, -1 in fl",
        ),
        (
            "field voltage",
            NumericalError.exit_code,
            r"grid: Efd_pu\.G7 is not finite \(nan\) at t = 0\.1667 s",
        ),
        (
            "frequency",
            NumericalError.exit_code,
            r"grid: f_hz\.B6 is beyond 3\.4e\+38 \(\S+\) at t = 0\.1833 s",
        ),
        (
            "state",
            NumericalError.exit_code,
            r"grid: omega\.G7 is not finite at t = 0\.1667 s",
        ),
    ],
)
def test_a_fault_inside_ends_the_run_with_its_name_and_time(
    tmp_path: Path, way: str, code: int, words: str
) -> None:
    """A result with a lost packet or a number that is none must not be mistaken for a whole one."""
    experiment = tmp_path / "quick.yaml"
    experiment.write_text("extends: g26_trip_smoke\nname: quick\n")
    network = "network={engine: constant, delay: 30 ms}"
    commands = {"together": (sys.executable, str(SPOILT), way)}
    with pytest.raises(RunFailedError, match=words) as failure:
        run(str(experiment), tmp_path / "r", *SETTINGS, network, commands=commands)
    assert failure.value.exit_code == code
    manifest = read_manifest(tmp_path / "r")
    assert manifest["status"] == "incomplete"
    assert manifest["reason"].startswith("grid" if code == NumericalError.exit_code else "network")

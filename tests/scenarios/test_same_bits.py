"""One experiment with cross traffic and loss, over every way in which the federates can meet.

local     grid <-> network                      one process, no HELICS
inproc    grid <-> HELICS <-> network           one process, two threads
zmq, tcp  grid <-> broker <-> network           three processes, either one first, with pauses
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scenarios.study import run
from tieline.cosim.interfaces import GRID, NETWORK
from tieline.experiment.launch import Outcome, launch
from tieline.experiment.results import Run

LOSSY = (
    "grid.duration=1.5 s",
    "grid.events=[{at: 0.5 s, trip_generator: G26}]",
    "network.loss=0.01",
    "network.record_packets=true",
    "network.cross_traffic=1.5",
    "seed=7",
)
PAUSING = Path(__file__).parent / "pausing.py"


def hashes(result: Run) -> dict[str, str]:
    return dict(result.manifest["tables"])


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    result = run("g26_trip_smoke", tmp_path_factory.mktemp("local") / "r", *LOSSY, *core("local"))
    flows = result.table("flows")
    assert flows["dropped_loss"].sum() > 0
    assert set(hashes(result)) >= {"grid.parquet", "flows.parquet", "packets.parquet"}
    return hashes(result)


def core(name: str) -> tuple[str, str]:
    return (f"federation.core={name}", "federation.hang_timeout=60 s")


@pytest.mark.smoke
@pytest.mark.helics
@pytest.mark.parametrize("name", ["inproc", "zmq", "tcp"])
def test_every_core_gives_the_bits_of_the_run_without_helics(
    name: str, expected: dict[str, str], tmp_path: Path
) -> None:
    """A federation that changed a result could not be debugged, repeated or believed."""
    assert hashes(run("g26_trip_smoke", tmp_path / "r", *LOSSY, *core(name))) == expected


@pytest.mark.helics
@pytest.mark.parametrize("order", [(GRID, NETWORK), (NETWORK, GRID)])
@pytest.mark.parametrize("seed", [1, 2])
def test_neither_start_order_nor_pauses_change_a_bit(
    order: tuple[str, str], seed: int, expected: dict[str, str], tmp_path: Path
) -> None:
    """Which computer is the faster one must not decide which packets a controller has seen."""
    commands = {role: (sys.executable, str(PAUSING), str(seed), role) for role in (GRID, NETWORK)}
    result = run(
        "g26_trip_smoke",
        tmp_path / "r",
        *LOSSY,
        *core("zmq"),
        commands=commands,
        order=order,
        stagger_s=0.5,
    )
    assert hashes(result) == expected


@pytest.mark.helics
@pytest.mark.parametrize("lead", [0, 1, 3])
def test_how_far_the_network_leads_changes_no_bit(
    lead: int, expected: dict[str, str], tmp_path: Path
) -> None:
    """How the federates share their work must not decide what comes out of it."""

    def launch_with(folder: Path, report: Callable[..., None], **how: Any) -> Outcome:
        path = folder / "run.json"
        told = json.loads(path.read_text())
        assert told["clock"]["lead"] == 5
        told["clock"]["lead"] = lead
        path.write_text(json.dumps(told))
        return launch(folder, report, **how)

    result = run("g26_trip_smoke", tmp_path / "r", *LOSSY, *core("zmq"), launch=launch_with)
    assert hashes(result) == expected


def test_another_seed_gives_other_packets(expected: dict[str, str], tmp_path: Path) -> None:
    """If the seed did nothing, equal hashes would prove nothing."""
    result = run("g26_trip_smoke", tmp_path / "r", *LOSSY, "seed=8", *core("local"))
    assert hashes(result)["packets.parquet"] != expected["packets.parquet"]
    assert hashes(result)["grid.parquet"] != expected["grid.parquet"]

"""A controller of somebody else's in the loop, and the same run started by HELICS's own runner.

grid <- grid/modulation <- damper/G34 <- network/packets <- network
                               |
                           recorder (a clone of every message to and from it)
"""

import base64
import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from scenarios.study import run
from tieline.cosim.ports import reserved_port
from tieline.experiment.gather import gather
from tieline.experiment.results import Run, read_runs

EXAMPLE = str(Path(__file__).parents[2] / "examples" / "guest_controller" / "experiment.yaml")
RUNNER = str(Path(__file__).parents[2] / "runner.py")
SHORT = ("grid.duration=1.2 s", "grid.events=[{at: 0.5 s, trip_generator: G26}]")
PATIENT = ("federation.hang_timeout=60 s",)


@pytest.fixture(scope="module")
def guided(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(EXAMPLE, tmp_path_factory.mktemp("guided") / "r", *SHORT, *PATIENT)


@pytest.mark.helics
def test_a_guest_moves_the_machine_that_it_may_and_none_before_it_speaks(
    guided: Run, tmp_path: Path
) -> None:
    """Else the controller of a user would not be in the loop, or more than it would be."""
    settings = (*SHORT, "federation.guests=[]", "federation.core=local")
    alone = run(EXAMPLE, tmp_path / "r", *settings).table("grid")
    signals, grid = guided.table("modulation"), guided.table("grid")
    assert set(signals["unit"]) == {"G34"}
    assert set(signals["guest"]) == {"damper"}
    np.testing.assert_array_equal(signals["v_s_pu"], np.clip(signals["asked_pu"], -0.05, 0.05))
    # Sent 3 us after one instant of the clock, a signal acts from the next one on.
    assert np.abs(signals["t_s"] - signals["sent_s"] - (1 / 60 - 3e-6)).max() < 2e-9
    first_s = signals.loc[signals["v_s_pu"] != 0.0, "t_s"].iloc[0]
    assert 0.5 < first_s < 0.8
    quiet = (grid["t_s"] < first_s - 1e-9).to_numpy()
    for column in alone.columns:
        np.testing.assert_array_equal(grid[column][quiet], alone[column][quiet])
    moved = grid["Efd_pu.G34"] - alone["Efd_pu.G34"]
    last = signals["v_s_pu"].iloc[-1]
    assert np.sign(moved.iloc[-1]) == np.sign(last)
    assert abs(moved.iloc[-1]) > 10 * abs(last)


@pytest.mark.helics
def test_a_guest_gets_the_c37118_bytes_of_each_packet_at_its_arrival(guided: Run) -> None:
    """Else a controller would be tried on data that no network ever carried."""
    words = json.loads((guided.folder / "packets.json").read_text())["messages"]
    packets = [word for word in words if word["dest"] == "damper/G34"]
    flows = guided.table("flows")
    assert len(packets) == flows.loc[flows["destination"] == "ctl33", "delivered"].sum()
    frames = [base64.b64decode(word["message"][4:-1]) for word in packets]
    assert {(len(frame), frame[:2]) for frame in frames} == {(34, b"\xaa\x01")}
    measured_s = [
        struct.unpack_from(">I", frame, 6)[0]
        + (struct.unpack_from(">I", frame, 10)[0] & 0xFFFFFF) / 1e6
        for frame in frames
    ]
    delay_s = np.array([word["time"] for word in packets]) - measured_s
    assert 0.09 < delay_s.min() < delay_s.max() < 0.12
    signals = [float(word["message"]) for word in words if word["dest"] == "grid/modulation"]
    # What is sent at the last instant of all reaches a grid that has ended.
    np.testing.assert_array_equal(
        signals[: len(guided.table("modulation"))], guided.table("modulation")["asked_pu"]
    )


@pytest.mark.helics
@pytest.mark.slow
def test_helicss_own_runner_gives_the_same_bits(guided: Run, tmp_path: Path) -> None:
    """Else a federation that HELICS's users start themselves would be another experiment."""
    folder = tmp_path / "helics"
    with reserved_port() as port:
        settings = [word for setting in SHORT for word in ("--set", setting)]
        where = ["--out", str(folder), "--port", str(port)]
        for command in (
            [sys.executable, RUNNER, "export-helics", EXAMPLE, *settings, *where],
            [sys.executable, "-m", "helics.cli", "run", f"--path={folder}/runner.json"],
        ):
            done = subprocess.run(command, capture_output=True, text=True, timeout=200, check=False)
            assert done.returncode == 0, done.stdout + done.stderr
    (result,) = read_runs(gather([folder], tmp_path / "result"))
    assert result.is_complete
    assert result.manifest["tables"] == guided.manifest["tables"]
    assert (result.folder / "packets.json").read_bytes() == (
        guided.folder / "packets.json"
    ).read_bytes()

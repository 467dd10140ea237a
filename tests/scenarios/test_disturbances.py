"""The shipped disturbances of the miniWECC, from their files to their results."""

from pathlib import Path

import numpy as np
import pytest

from scenarios.study import run
from tieline.experiment.results import Run

LOCAL = ("federation.core=local", "grid.duration=6 s")


def of(result: Run, column: str) -> np.ndarray:
    return result.table("grid")[column].to_numpy()


def test_a_fault_sags_clears_and_rings_down(tmp_path: Path) -> None:
    """A system that survives comes back to the voltage and speed that it had."""
    result = run("fault_86", tmp_path / "r", *LOCAL)
    t_s, v = of(result, "t_s"), of(result, "v_pu.B86")
    during = (t_s > 1.01) & (t_s < 1.09)
    assert v[during].max() < 1e-3
    assert v[t_s > 5.5].min() > 0.95
    texts = [text for _, text in result.events()]
    assert texts == [
        "fault at bus 86",
        "branch 86-87 opens at bus 86",
        "branch 86-87 opens at its far end",
    ]
    assert result.summary()["ending"] is None


def test_a_brake_slows_the_system_down_while_it_is_on(tmp_path: Path) -> None:
    """1.4 GW for half a second is a step of load and back."""
    result = run("brake_18", tmp_path / "r", *LOCAL)
    t_s, coi = of(result, "t_s"), of(result, "coi_pu")
    assert coi[(t_s > 1.0) & (t_s < 1.5)].min() < 1.0 - 1e-4
    assert t_s[np.argmin(coi)] == pytest.approx(1.5, abs=0.2)
    # A first swing later the energy that it took is restored by the governors.
    assert coi[-1] > coi.min() + 1e-4


def test_the_loss_of_g14_is_seen_first_beside_it(tmp_path: Path) -> None:
    """Bus 33 is G14's own; its frequency falls before that of southern California."""
    result = run("g14_trip", tmp_path / "r", *LOCAL)
    t_s = of(result, "t_s")
    after = (t_s > 1.0) & (t_s < 1.4)
    assert of(result, "f_hz.B33")[after].min() < of(result, "f_hz.B49")[after].min() - 5e-3
    assert result.summary()["frequency"]["nadir_hz"] == pytest.approx(59.91, abs=0.02)


def test_a_run_without_a_future_ends_as_a_result(tmp_path: Path) -> None:
    """A fault that is not cleared is an answer, not a crash: exit 0, and the reason in words."""
    settings = ("grid.events=[{at: 0.5 s, fault_bus: 119, clear_after: 800 ms}]", *LOCAL)
    result = run("g26_trip_smoke", tmp_path / "r", *settings)
    ending = result.summary()["ending"]
    assert ending.startswith(("unstable", "voltage collapse"))
    assert result.is_complete
    assert of(result, "t_s")[-1] < 6.0

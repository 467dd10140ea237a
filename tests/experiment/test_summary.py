"""The numbers of the closing table, against a result made from formulas."""

import csv
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synthetic_result import (
    DAMPING_RATIO,
    EXPERIMENT,
    NADIR_PU,
    SETTLING_PU,
    SWEEP,
    SWING_HZ,
    fake_launch,
    known_sites,
    plan_of,
)
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.experiment.results import Run, read_runs
from tieline.experiment.run import execute
from tieline.experiment.sites import Sites
from tieline.experiment.summary import summarise
from tieline.experiment.table import FIELDS, shown, write_csv
from tieline.tables import Column, write_table


def run_of(tmp_path: Path, *settings: str, text: str = EXPERIMENT) -> Run:
    """Return a run of the synthetic result, changed by settings."""
    return read_runs(execute(plan_of(tmp_path, text, settings), tmp_path / "out", fake_launch))[-1]


def summary_of(tmp_path: Path, *settings: str, text: str = EXPERIMENT) -> dict[str, Any]:
    """Return the summary of a synthetic run."""
    return summarise(run_of(tmp_path, *settings, text=text))


def test_nadir_and_settling_value_are_those_of_the_centre_of_inertia(tmp_path: Path) -> None:
    """Otherwise the main figure of the study would be wrong.

    The made frequency is 1 - a(1 - exp(-x)) - b x/3 exp(1 - x/3), x seconds after the event: its
    minimum is found here by a fine search; recorded instants are 1/60 s apart.
    """
    import numpy as np

    x = np.linspace(0, 40, 400_001)
    tau = x / 3
    a, b = 1 - SETTLING_PU, SETTLING_PU - NADIR_PU
    exact = 60 * (1 - a * (1 - np.exp(-x)) - b * tau * np.exp(1 - tau))
    found = summary_of(tmp_path)["frequency"]
    assert found["nadir_hz"] == pytest.approx(exact.min(), abs=1e-6)
    assert found["nadir_s"] == pytest.approx(1 + x[exact.argmin()], abs=1 / 60)
    assert found["settling_window_s"] == 5.0
    assert found["settling_hz"] == pytest.approx(exact[x >= 35].mean(), abs=1e-6)


def test_the_settling_window_of_a_short_run_is_its_last_tenth(tmp_path: Path) -> None:
    """Otherwise a short run would settle where its event still shows."""
    frequency = summary_of(tmp_path, "grid.duration=11 s")["frequency"]
    assert frequency["settling_window_s"] == pytest.approx(1.0)


def test_the_swing_of_the_tie_mode_is_found(tmp_path: Path) -> None:
    """Otherwise a loss of damping would go unnoticed.

    The made difference of speeds is one damped sinusoid: only rounding remains.
    """
    swing = summary_of(tmp_path)["swing"]
    assert swing["frequency_hz"] == pytest.approx(SWING_HZ, rel=1e-6)
    assert swing["damping_ratio"] == pytest.approx(DAMPING_RATIO, abs=1e-6)
    assert swing["window_s"] == [3.0, 18.0]


def test_a_short_run_says_why_it_has_no_swing(tmp_path: Path) -> None:
    """Otherwise a damping would be read off half a period."""
    swing = summary_of(tmp_path, "grid.duration=5 s")["swing"]
    assert swing["damping_ratio"] is None
    assert "shorter than 10 s" in swing["reason"]


@pytest.mark.parametrize(
    ("tie_mode", "reason"),
    [
        (None, "names no tie mode"),
        ({"units": ["G34"], "against": ["G26"]}, "no speed of G26"),
        ({"units": ["G99"], "against": ["G21"]}, "no speed of G99"),
    ],
)
def test_a_swing_without_its_units_has_a_reason(
    tmp_path: Path, tie_mode: dict[str, Any] | None, reason: str
) -> None:
    """Otherwise a tripped unit, which runs away, would be taken for one side of the tie."""
    (tmp_path / "tiny.yaml").write_text(EXPERIMENT + "network: {engine: ideal}\n")
    sites = known_sites()
    plan = prepare(
        load_experiment(str(tmp_path / "tiny.yaml")),
        lambda *_: Sites(sites.sensors, sites.controllers, 60.0, tie_mode),
    )
    (run,) = read_runs(execute(plan, tmp_path / "out", fake_launch))
    assert reason in summarise(run)["swing"]["reason"]


def test_delays_are_those_of_the_delivered_packets(tmp_path: Path) -> None:
    """Otherwise the delay under study would not be the one that the controllers met.

    The made histogram is symmetric about 250 ms; its 95 % point lies 1.163 standard deviations
    times sqrt(2) * 4 ms / sqrt(2) above, read off bins of 1 ms.
    """
    delay = summary_of(tmp_path)["delay"]
    assert delay["mean_s"] == pytest.approx(0.25)
    assert delay["p50_s"] == pytest.approx(0.25, abs=5e-5)
    assert delay["p95_s"] == pytest.approx(0.25 + 0.004 * 1.163, abs=2e-4)
    assert delay["max_s"] == pytest.approx(0.26)
    assert delay["jitter_s"] == pytest.approx(0.002)


def test_every_packet_is_accounted_for(tmp_path: Path) -> None:
    """Otherwise packets under way at the end would count as lost."""
    packets = summary_of(tmp_path)["packets"]
    ended = packets["delivered"] + packets["dropped_queue"] + packets["dropped_loss"]
    assert packets["sent"] == ended + packets["in_flight"] == 6000
    assert packets["loss"] == pytest.approx(10 / 995)


def test_continuous_reporting_has_the_delay_of_its_setting(tmp_path: Path) -> None:
    """Otherwise the reference case of a sweep would have no delay to compare with."""
    found = summary_of(tmp_path, "wams.reporting=continuous")
    assert found["delay"]["mean_s"] == found["delay"]["p95_s"] == 0.25
    assert found["packets"]["sent"] == 0


def test_the_lowest_voltage_leaves_the_tripped_unit_out(tmp_path: Path) -> None:
    """Otherwise a unit that is gone would be named as the one in trouble."""
    lowest = summary_of(tmp_path)["lowest_voltage"]
    assert lowest["unit"] == "G34"
    assert lowest["vt_pu"] == pytest.approx(0.97)
    assert lowest["t_s"] == pytest.approx(4.0)


def test_the_age_counts_from_the_first_data(tmp_path: Path) -> None:
    """Otherwise the wait for the first frame would be averaged in."""
    age = summary_of(tmp_path)["age"]
    assert age["mean_s"] == pytest.approx(0.25)
    assert set(age["controllers_s"]) == {"G21", "G34"}


def test_the_table_as_csv_holds_plain_numbers(tmp_path: Path) -> None:
    """Otherwise a spreadsheet would have to take units off the numbers."""
    plan = plan_of(tmp_path, EXPERIMENT + SWEEP)
    runs = read_runs(execute(plan, tmp_path / "out", fake_launch))
    write_csv(tmp_path / "table.csv", [run.summary() for run in runs])
    with (tmp_path / "table.csv").open(newline="") as file:
        ideal, late = csv.DictReader(file)
    assert ideal["label"] == "ideal"
    assert float(late["delay_mean_s"]) == pytest.approx(0.25)
    assert float(late["damping_ratio"]) == pytest.approx(DAMPING_RATIO, abs=1e-6)


def test_a_missing_number_is_a_dash() -> None:
    """Otherwise a run without packets would show a delay of nothing."""
    summary = {"delay": {"mean_s": None}}
    assert shown(summary, FIELDS[0]) == "-"
    assert shown({"delay": {"mean_s": 0.1}}, FIELDS[0]) == "100.0"


def test_a_run_that_ends_before_any_event_has_a_summary(tmp_path: Path) -> None:
    """Too much gain is an answer: a run that loses stability by itself must not end as a fault."""

    def unstable(folder: Path, on_progress: Any) -> Any:
        done = fake_launch(folder, on_progress)
        columns = [
            Column("t_s", "s", "instant"),
            Column("what", "", "event", "str"),
            Column("is_ending", "", "1 if the run ended with it", "int64"),
        ]
        log = {
            "t_s": np.array([41.1]),
            "what": np.array(["synchronism lost"], dtype=object),
            "is_ending": np.array([1]),
        }
        write_table(folder / "events.parquet", columns, log)
        return done

    folder = execute(plan_of(tmp_path), tmp_path / "out", unstable)
    summary = read_runs(folder)[0].summary()
    assert summary["ending"].startswith("synchronism lost")
    # The dip is not quite over when the settling has come close: 6 mHz above the formula's nadir.
    assert summary["frequency"]["nadir_hz"] == pytest.approx(60 * NADIR_PU, abs=0.01)


def test_a_summary_needs_no_pandas(tmp_path: Path) -> None:
    """Every run, and every point of a sweep, would end half a second later for its import."""
    run = run_of(tmp_path)
    script = (
        "import sys; from pathlib import Path; from tieline.experiment.results import read_runs;"
        "from tieline.experiment.summary import summarise;"
        "summarise(read_runs(Path(sys.argv[1]))[0]); print('pandas' in sys.modules)"
    )
    told = subprocess.run(
        [sys.executable, "-c", script, run.folder], check=True, capture_output=True, text=True
    )
    assert told.stdout == "False\n"

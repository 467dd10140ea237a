"""A sweep's folder: finished points stay, failed ones are listed, one table at the end."""

import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from synthetic_result import EXPERIMENT, SWEEP, fake_launch, plan_of
from tieline.errors import CosimError, InputError, NumericalError
from tieline.experiment import point
from tieline.experiment.launch import Outcome
from tieline.experiment.points_table import points_table
from tieline.experiment.results import read_manifest, read_runs
from tieline.experiment.run import execute
from tieline.experiment.sweep_run import InTurn, Listener, PointsFailedError, run_sweep
from tieline.experiment.watch import Progress

OnProgress = Callable[[Progress], None]
THREE = f"{SWEEP}  - {{label: slow, seed: 5, network.engine: constant, network.delay: 500 ms}}\n"


class Launches:
    """Launches that write a result, or fail at one point; it counts them."""

    def __init__(self, fails_at: str = "", error: BaseException | None = None) -> None:
        self.slugs: list[str] = []
        self._fails_at = fails_at
        self._error = error or CosimError("lost\n  | last words")

    def __call__(self, folder: Path, on_progress: OnProgress) -> Outcome:
        slug = json.loads((folder / "run.json").read_text())["run_id"].split("-", 1)[1][:-9]
        self.slugs.append(slug)
        if slug == self._fails_at:
            raise self._error
        return fake_launch(folder, on_progress)


def swept(folder: Path, launches: Launches, text: str = THREE, **how: bool) -> Path:
    """Run a sweep into `folder/out`."""
    return run_sweep(
        plan_of(folder, EXPERIMENT + text), folder / "out", InTurn(launches), Listener(), **how
    )


def test_a_failed_point_does_not_lose_the_others(tmp_path: Path) -> None:
    """Otherwise one bad point would cost a night's sweep."""
    launches = Launches("0.25-s", NumericalError("diverged\n  | last words"))
    with pytest.raises(
        PointsFailedError, match=r"1 of 3 points failed.*\n  0\.25 s: diverged\n"
    ) as e:
        swept(tmp_path, launches)
    assert launches.slugs == ["ideal", "0.25-s", "slow"]
    assert e.value.exit_code == NumericalError.exit_code
    manifest = read_manifest(tmp_path / "out")
    assert (manifest["kind"], manifest["status"]) == ("sweep", "incomplete")
    assert "diverged" in manifest["reason"]
    assert [run.is_complete for run in read_runs(tmp_path / "out")] == [True, False, True]
    table = pd.read_csv(tmp_path / "out" / "points.csv")
    assert list(table["status"]) == ["complete", "incomplete", "complete"]
    assert table["frequency.nadir_hz"].notna().tolist() == [True, False, True]


def test_a_sweep_goes_on_where_it_stopped(tmp_path: Path) -> None:
    """Otherwise an interruption would cost every finished point."""
    with pytest.raises(KeyboardInterrupt):
        swept(tmp_path, Launches("0.25-s", KeyboardInterrupt()))
    assert read_manifest(tmp_path / "out")["reason"] == "interrupted from the keyboard"
    assert sorted(path.name for path in (tmp_path / "out" / "points").iterdir()) == ["ideal"]
    assert list(points_table(tmp_path / "out")["status"]) == ["complete", "missing", "missing"]
    again = Launches()
    swept(tmp_path, again)
    assert again.slugs == ["0.25-s", "slow"]
    assert read_manifest(tmp_path / "out")["status"] == "complete"


def test_a_point_with_another_setting_runs_again(tmp_path: Path) -> None:
    """Otherwise a table would mix results of two experiments."""
    swept(tmp_path, Launches())
    again = Launches()
    swept(tmp_path, again, THREE.replace("seed: 5", "seed: 6"))
    assert again.slugs == ["slow"]


def test_a_point_of_another_version_or_case_runs_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise a corrected model would keep its old results."""
    swept(tmp_path, Launches())
    path = tmp_path / "out" / "points" / "slow" / "manifest.json"
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps({**manifest, "inputs": {"case": "other"}}))
    again = Launches()
    swept(tmp_path, again)
    assert again.slugs == ["slow"]
    monkeypatch.setattr("tieline.__version__", "9.9")
    again = Launches()
    swept(tmp_path, again)
    assert again.slugs == ["ideal", "0.25-s", "slow"]


def test_fresh_runs_every_point_again(tmp_path: Path) -> None:
    """Otherwise there would be no way to repeat a sweep in its folder."""
    swept(tmp_path, Launches())
    again = Launches()
    swept(tmp_path, again, is_fresh=True)
    assert again.slugs == ["ideal", "0.25-s", "slow"]


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    """Otherwise a slip in --out would mix two results."""
    execute(plan_of(tmp_path), tmp_path / "out", fake_launch)
    with pytest.raises(InputError, match="holds the run 'tiny', and no sweep 'tiny'"):
        swept(tmp_path, Launches())
    assert read_manifest(tmp_path / "out")["kind"] == "run"


def test_two_sweeps_never_work_in_one_folder(tmp_path: Path) -> None:
    """Otherwise one would remove what the other is writing."""

    def launch(folder: Path, on_progress: OnProgress) -> Outcome:
        with pytest.raises(InputError, match="another sweep is at work"):
            swept(tmp_path, Launches())
        return fake_launch(folder, on_progress)

    run_sweep(plan_of(tmp_path, EXPERIMENT + THREE), tmp_path / "out", InTurn(launch))
    assert read_manifest(tmp_path / "out")["status"] == "complete"


def test_the_table_has_swept_settings_then_figures_in_si_units(tmp_path: Path) -> None:
    """Otherwise each user would have to gather them from a hundred files."""
    folder = swept(tmp_path, Launches())
    table = pd.read_parquet(folder / "points.parquet")
    assert list(table["label"]) == ["ideal", "0.25 s", "slow"]
    first = ["label", "folder", "status", "network.engine", "wams.reporting", "network.delay"]
    assert list(table.columns[:7]) == [*first, "seed"]
    assert list(table["network.delay"])[1:] == [0.25, 0.5]
    assert list(table["wams.reporting"]) == ["continuous", "60", "60"]
    assert list(table["seed"]) == [1, 1, 5]
    assert table["frequency.nadir_hz"].round(2).tolist() == [59.77] * 3
    assert not [name for name in table if name.startswith("times")]
    pd.testing.assert_frame_equal(table, pd.read_csv(folder / "points.csv"), check_dtype=False)


def test_the_manifest_tells_what_to_resume_with(tmp_path: Path) -> None:
    """Otherwise one would have to remember the options of an interrupted sweep."""
    plan = plan_of(tmp_path, EXPERIMENT + THREE, ["grid.duration=30 s"])
    manifest = read_manifest(run_sweep(plan, tmp_path / "out", InTurn(Launches())))
    assert manifest["config_file"] == str(tmp_path / "tiny.yaml")
    assert manifest["options"] == ['grid.duration="30 s"']
    assert manifest["points"][2]["settings"] == {
        "network.engine": "constant",
        "wams.reporting": 60,
        "network.delay": 0.5,
        "seed": 5,
    }


def test_a_host_with_another_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise a cluster could mix the results of two versions in one table."""
    (planned, *_) = plan_of(tmp_path, EXPERIMENT + THREE).runs
    task = point.task_of(planned, tmp_path / "points" / "a")
    with pytest.raises(InputError, match="sees no folder"):
        point.run_task(tmp_path / "work", task, Launches())
    monkeypatch.setattr("tieline.__version__", "9.9")
    with pytest.raises(CosimError, match=r"has tieline 9\.9, but the sweep was planned by"):
        point.run_task(tmp_path / "work", task, Launches())


def test_of_two_attempts_at_one_point_the_first_to_finish_stays(tmp_path: Path) -> None:
    """Otherwise a worker thought dead could replace a result that was already read."""
    (tmp_path / "points").mkdir()
    (planned, *_) = plan_of(tmp_path, EXPERIMENT + THREE).runs
    task = point.task_of(planned, tmp_path / "points" / "a")
    point.run_task(tmp_path / "points" / ".one", task, Launches())
    before = (tmp_path / "points" / "a" / "manifest.json").stat().st_ino
    point.run_task(tmp_path / "points" / ".two", task, Launches())
    assert (tmp_path / "points" / "a" / "manifest.json").stat().st_ino == before
    assert [path.name for path in (tmp_path / "points").iterdir()] == ["a"]

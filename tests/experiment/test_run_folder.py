"""The result folder: named when whole, kept and marked when a run fails."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from synthetic_result import EXPERIMENT, SWEEP, fake_launch, outcome, plan_of, write_grid
from tieline.cosim.interfaces import GRID, NETWORK
from tieline.errors import CosimError, InputError
from tieline.experiment.launch import FederateFailedError, Outcome
from tieline.experiment.results import read_manifest, read_runs, table_hash
from tieline.experiment.run import RunFailedError, check_target, default_target, execute
from tieline.experiment.watch import Progress, Suspect
from tieline.tables import Column, TableStream

OnProgress = Callable[[Progress], None]


def failing_launch(folder: Path, on_progress: OnProgress) -> Outcome:
    """Write half a run, then fail as a dead federate does; a stream is left open."""
    TableStream(folder / "grid.parquet", [Column("t_s", "s", "time")])
    raise FederateFailedError(Suspect(GRID, "died at 20 s", 4), outcome(20.0), ["last words"])


def fails_at(label: str) -> Callable[[Path, OnProgress], Outcome]:
    """Return a launch that works but for one point of a sweep."""

    def launch(folder: Path, on_progress: OnProgress) -> Outcome:
        if folder.name == label:
            raise CosimError("lost")
        return fake_launch(folder, on_progress)

    return launch


def read(path: Path) -> Any:
    """Return what a JSON file holds."""
    return json.loads(path.read_text(encoding="utf-8"))


def test_a_whole_run_is_complete_and_nothing_else_remains(tmp_path: Path) -> None:
    """Otherwise half-written folders would lie about beside the results."""
    folder = execute(plan_of(tmp_path), tmp_path / "deep" / "out", fake_launch)
    assert folder == tmp_path / "deep" / "out"
    assert sorted(path.name for path in folder.parent.iterdir()) == ["out"]
    names = {path.name for path in folder.iterdir()}
    expected = {"manifest.json", "run.json", "summary.json", "grid.parquet", "flows.parquet"}
    assert expected <= names
    manifest = read_manifest(folder)
    assert (manifest["status"], manifest["reason"]) == ("complete", None)


def test_the_target_appears_only_when_the_run_is_whole(tmp_path: Path) -> None:
    """Otherwise a reader could take a run under way for a finished one."""
    target = tmp_path / "out"

    def launch(folder: Path, on_progress: OnProgress) -> Outcome:
        assert not target.exists()
        assert folder.parent == target.parent
        assert read_manifest(folder)["status"] == "incomplete"
        return fake_launch(folder, on_progress)

    execute(plan_of(tmp_path), target, launch)
    assert target.is_dir()


def test_the_manifest_says_where_a_result_came_from(tmp_path: Path) -> None:
    """Otherwise nobody could make the result again."""
    folder = execute(plan_of(tmp_path), tmp_path / "out", fake_launch)
    manifest = read_manifest(folder)
    assert manifest["config"]["network"]["delay"] == 0.25
    assert manifest["config"]["grid"]["steps_per_second"] == 240
    assert len(manifest["config_hash"]) == 64
    assert len(manifest["inputs"]["case"]) == 64
    assert {"tieline", "python", "helics", "numpy", "numba"} <= set(manifest["versions"])
    assert manifest["granted_ns"] == {GRID: 41_000_002_000, NETWORK: 41_000_001_000}
    assert manifest["times"]["wall_s"] == 1.75
    assert manifest["times"]["cpu_s"] == {GRID: 1.25, NETWORK: 0.5}
    assert manifest["peak_memory_bytes"] == {GRID: 200_000_000, NETWORK: 100_000_000}
    assert manifest["tables"]["grid.parquet"] == table_hash(folder / "grid.parquet")


def test_a_failed_run_is_kept_readable_and_marked(tmp_path: Path) -> None:
    """Otherwise the hours before a fault would be lost, or taken for a whole run."""
    target = tmp_path / "out"
    with pytest.raises(
        RunFailedError, match=r"died at 20 s\n(.|\n)*out, marked incomplete"
    ) as caught:
        execute(plan_of(tmp_path), target, failing_launch)
    assert caught.value.exit_code == CosimError.exit_code
    assert caught.value.folder == target
    manifest = read_manifest(target)
    assert manifest["status"] == "incomplete"
    assert "died at 20 s" in manifest["reason"]
    assert manifest["granted_ns"][GRID] == 20_000_002_000
    (run,) = read_runs(target)
    assert list(run.table("grid").columns) == ["t_s"]
    assert not list(tmp_path.glob(".out*"))


def test_the_exit_code_of_the_federates_own_error_is_kept(tmp_path: Path) -> None:
    """Otherwise a diverged simulation and a broken federation would look the same to a script."""

    def launch(folder: Path, on_progress: OnProgress) -> Outcome:
        raise FederateFailedError(Suspect(GRID, "not finite", 3), outcome(1.0), [])

    with pytest.raises(RunFailedError) as caught:
        execute(plan_of(tmp_path), tmp_path / "out", launch)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    ("error", "reason"),
    [(KeyboardInterrupt(), "interrupted from the keyboard"), (ValueError("a"), "ValueError: a")],
)
def test_an_interrupted_run_is_marked_too(
    tmp_path: Path, error: BaseException, reason: str
) -> None:
    """Otherwise Ctrl-C would leave a folder that says nothing."""

    def launch(folder: Path, on_progress: OnProgress) -> Outcome:
        write_grid(folder, 2.0)
        raise error

    with pytest.raises(type(error)):
        execute(plan_of(tmp_path), tmp_path / "out", launch)
    manifest = read_manifest(tmp_path / "out")
    assert (manifest["status"], manifest["reason"]) == ("incomplete", reason)
    assert "grid.parquet" in manifest["tables"]


def test_a_sweep_has_a_summary_of_all_its_points(tmp_path: Path) -> None:
    """Otherwise every reader would have to gather them."""
    folder = execute(plan_of(tmp_path, EXPERIMENT + SWEEP), tmp_path / "out", fake_launch)
    points = read(folder / "summary.json")["points"]
    assert [point["label"] for point in points] == ["ideal", "0.25 s"]
    assert points[1] == read(folder / "points" / "0.25-s" / "summary.json")


def test_an_earlier_result_is_replaced_by_a_whole_one(tmp_path: Path) -> None:
    """Otherwise a repeated command would need a new name each time."""
    target = tmp_path / "out"
    execute(plan_of(tmp_path, EXPERIMENT + SWEEP), target, fake_launch)
    execute(plan_of(tmp_path), target, fake_launch)
    assert read_manifest(target)["kind"] == "run"
    assert not (target / "points").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "tiny.yaml"]


def test_an_earlier_whole_result_survives_a_failure(tmp_path: Path) -> None:
    """Otherwise a failed attempt would destroy a good result."""
    target = tmp_path / "out"
    execute(plan_of(tmp_path), target, fake_launch)
    for _ in range(2):
        with pytest.raises(RunFailedError, match="out-incomplete, marked incomplete"):
            execute(plan_of(tmp_path), target, failing_launch)
    assert read_manifest(target)["status"] == "complete"
    assert read_manifest(tmp_path / "out-incomplete")["status"] == "incomplete"


def test_what_is_no_result_is_never_overwritten(tmp_path: Path) -> None:
    """Otherwise a slip in --out would delete a user's files."""
    target = tmp_path / "thesis"
    target.mkdir()
    check_target(target)
    (target / "chapter.tex").write_text("")
    with pytest.raises(InputError, match="holds files that are no result of tieline"):
        execute(plan_of(tmp_path), target, fake_launch)
    with pytest.raises(InputError, match="is a file"):
        check_target(target / "chapter.tex")
    assert [path.name for path in target.iterdir()] == ["chapter.tex"]


def test_a_target_that_cannot_be_made_is_an_input_error(tmp_path: Path) -> None:
    """Otherwise a missing permission would end in a traceback."""
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        execute(plan_of(tmp_path), tmp_path / "file" / "out", fake_launch)


def test_progress_is_simulated_time_of_each_point(tmp_path: Path) -> None:
    """Otherwise a bar would show the time of the wrong run."""
    heard: list[tuple[str, float]] = []
    plan = plan_of(tmp_path, EXPERIMENT + SWEEP)
    execute(plan, tmp_path / "out", fake_launch, lambda point, t: heard.append((point.slug, t)))
    assert heard == [("ideal", 20.5), ("ideal", 41.0), ("0.25-s", 20.5), ("0.25-s", 41.0)]


def test_unnamed_results_go_to_results_each_to_a_folder_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise runs that are started in one second would overwrite each other."""
    monkeypatch.chdir(tmp_path)
    targets = [default_target("tiny") for _ in range(3)]
    assert len(set(targets)) == 3
    assert {target.parent for target in targets} == {Path("results")}
    assert all(target.name.startswith("tiny-") and target.is_dir() for target in targets)


@pytest.mark.parametrize("name", [".", ".."])
def test_the_working_folder_is_no_place_for_a_result(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise a run would be lost at its end, when its folder cannot take the name."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="give one inside"):
        check_target(Path(name))

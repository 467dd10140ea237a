"""What dead launchers have left is taken up; a name goes from one whole folder to another."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tieline.experiment import folder as folders
from tieline.experiment.folder import FORMAT, UNDER_WAY, held, put_in_place
from tieline.experiment.rescue import take_up
from tieline.experiment.strays import RUN_VARIABLE
from tieline.tables import Column, TableStream, read_table


@pytest.fixture
def dead() -> int:
    """Return the number of a process that has ended."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def make(folder: Path, label: str, reason: str | None = UNDER_WAY) -> Path:
    """Make the folder of a run with 30 rows of its grid, as a stream if it is under way."""
    folder.mkdir()
    status = "complete" if reason is None else "incomplete"
    manifest = {"format": FORMAT, "kind": "run", "status": status, "reason": reason, "label": label}
    manifest |= {"name": "rescued", "config": {}}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / ".run.json.part").write_text("{")
    if reason == UNDER_WAY:
        stream = TableStream(folder / "grid.parquet", [Column("t_s", "s", "time")])
        stream.append({"t_s": np.arange(30) / 60})
        stream.flush()
    return folder


def manifest_of(folder: Path) -> Any:
    return json.loads((folder / "manifest.json").read_text())


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_run_that_was_under_way_is_readable_and_marked(tmp_path: Path, dead: int) -> None:
    """If not, a power user's kill -9 would leave hidden folders that no reader understands."""
    make(tmp_path / f".out.partial-{dead}", "new")
    take_up(tmp_path)
    assert names(tmp_path) == ["out"]
    manifest = manifest_of(tmp_path / "out")
    assert (manifest["status"], manifest["reason"]) == ("incomplete", "launcher: killed")
    assert manifest["last_valid_s"] == pytest.approx(29 / 60)
    assert len(read_table(tmp_path / "out" / "grid.parquet")) == 30
    assert names(tmp_path / "out") == ["grid.parquet", "manifest.json"]


def test_an_earlier_whole_result_stays_beside_it(tmp_path: Path, dead: int) -> None:
    """If not, a killed attempt would destroy a good result."""
    make(tmp_path / "out", "older", None)
    make(tmp_path / f".out.partial-{dead}", "new")
    take_up(tmp_path)
    assert names(tmp_path) == ["out", "out-incomplete"]
    assert manifest_of(tmp_path / "out")["label"] == "older"


def test_a_whole_result_that_only_lacked_its_name_gets_it(tmp_path: Path, dead: int) -> None:
    """If not, a kill in the last moment would cost the whole run."""
    make(tmp_path / "out", "older", None)
    make(tmp_path / f".out.partial-{dead}", "new", None)
    take_up(tmp_path)
    assert names(tmp_path) == ["out"]
    assert manifest_of(tmp_path / "out")["label"] == "new"


def test_an_earlier_result_whose_name_is_taken_goes(tmp_path: Path, dead: int) -> None:
    """If not, a kill just after the folders changed places would bring the old result back."""
    make(tmp_path / f".out.partial-{dead}", "older", None)
    make(tmp_path / "out", "new", None)
    take_up(tmp_path)
    assert names(tmp_path) == ["out"]
    assert manifest_of(tmp_path / "out")["label"] == "new"


def test_where_folders_cannot_change_places_a_kill_between_loses_neither(
    tmp_path: Path, dead: int
) -> None:
    """If not, a network file system would lose both results."""
    make(tmp_path / f".out.partial-{dead}.older", "older", None)
    make(tmp_path / f".out.partial-{dead}", "new")
    take_up(tmp_path)
    assert names(tmp_path) == ["out", "out-incomplete"]
    assert manifest_of(tmp_path / "out")["label"] == "older"


def test_what_a_living_launcher_writes_is_left_alone(tmp_path: Path, dead: int) -> None:
    """If not, two runs side by side would destroy each other."""
    make(tmp_path / f".out.partial-{os.getpid()}", "alive")
    elsewhere = make(tmp_path / f".out.partial-{dead}", "of another name space")
    with held(elsewhere):
        take_up(tmp_path)
    assert len(names(tmp_path)) == 2


def test_what_the_run_had_started_ends_with_it(tmp_path: Path, dead: int) -> None:
    """If not, a guest's deaf children would outlive every trace of their run."""
    work = make(tmp_path / f".out.partial-{dead}", "new")
    deaf = (
        "import signal, time; signal.signal(15, signal.SIG_IGN); print(flush=True); time.sleep(60)"
    )
    stray = subprocess.Popen(
        [sys.executable, "-S", "-c", f"{deaf}; t.sleep(60)"],
        env={**os.environ, RUN_VARIABLE: str(work)},
        stdout=subprocess.PIPE,
        start_new_session=True,
    )
    with stray:
        assert stray.stdout is not None
        stray.stdout.readline()
        take_up(tmp_path)
        assert stray.wait(timeout=10) == -9


@pytest.mark.parametrize("can_exchange", [True, False])
def test_a_folder_takes_its_name_and_nothing_else_remains(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, can_exchange: bool
) -> None:
    """If not, old and new files would mix, or old ones stay behind."""
    if not can_exchange:
        monkeypatch.setattr(folders, "_exchange", lambda one, other: False)
    make(tmp_path / "out", "older", None)
    (tmp_path / "out" / "old.txt").touch()
    put_in_place(make(tmp_path / ".out.partial-1", "new", None), tmp_path / "out")
    assert names(tmp_path) == ["out"]
    assert manifest_of(tmp_path / "out")["label"] == "new"
    assert not (tmp_path / "out" / "old.txt").exists()

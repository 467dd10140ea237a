"""A single run is checked in a fork while its launcher imports."""

from itertools import repeat
from pathlib import Path

import pytest

from synthetic_result import CONSTANT, EXPERIMENT, known_sites, plan_of
from tieline.errors import InputError
from tieline.experiment import plan
from tieline.experiment.load import Study, load_experiment
from tieline.experiment.point import task_of
from tieline.experiment.schema import Experiment
from tieline.experiment.sites import Sites
from tieline.sweeps.single import planned


def study_of(folder: Path) -> Study:
    """Return the study of the synthetic experiment."""
    path = folder / "tiny.yaml"
    path.write_text(EXPERIMENT, encoding="utf-8")
    return load_experiment(str(path), list(CONSTANT))


def test_the_task_is_that_of_a_plan_made_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run would otherwise not be the one that was asked for, nor its hash the same."""
    monkeypatch.setattr(plan.prepare, "__defaults__", (known_sites,))
    taken: list[str] = []
    task = planned(
        study_of(tmp_path),
        [lambda: taken.append("shared")],
        [lambda: taken.append("one"), lambda: taken.append("other")],
    )
    expected = task_of(plan_of(tmp_path).runs[0], Path())
    assert task.files == expected.files
    assert task.manifest == expected.manifest
    assert taken == ["shared", "one", "other"]


def test_every_finding_is_told_before_all_is_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wrong name would otherwise be told seconds late, or one mistake after the other."""

    def faulty(experiment: Experiment, case: Path, topology: Path | None) -> Sites:
        raise InputError(["no unit G99", "no bus 999"])

    monkeypatch.setattr(plan.prepare, "__defaults__", (faulty,))
    taken: list[int] = []

    with pytest.raises(InputError) as caught:
        planned(study_of(tmp_path), (), repeat(lambda: taken.append(1)))
    assert caught.value.findings == ("no unit G99", "no bus 999")
    assert taken

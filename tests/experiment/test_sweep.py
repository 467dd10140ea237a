"""Sweeps: what their points become."""

from pathlib import Path

import pytest

from synthetic_result import EXPERIMENT, SWEEP
from tieline.errors import InputError
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.experiment.schema import Experiment


def write(tmp_path: Path, text: str) -> str:
    """Write an experiment and return its path."""
    path = tmp_path / "tiny.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_each_point_is_the_experiment_with_its_own_settings(tmp_path: Path) -> None:
    """Otherwise the runs of a sweep would differ in more than what is swept."""
    found = load_experiment(write(tmp_path, EXPERIMENT + SWEEP))
    ideal, late = (point.experiment for point in found.points)
    assert (ideal.network.engine, ideal.wams.reporting) == ("ideal", "continuous")
    assert (late.network.engine, late.network.delay, late.wams.reporting) == ("constant", 0.25, 60)
    assert ideal.grid == late.grid
    assert [point.slug for point in found.points] == ["ideal", "0.25-s"]


def test_a_number_is_a_label(tmp_path: Path) -> None:
    """Otherwise a sweep over plain numbers would need quotes round each of them."""
    text = EXPERIMENT + "sweep: [{label: 1, seed: 1}, {label: 2.5, seed: 2}]\n"
    assert [p.label for p in load_experiment(write(tmp_path, text)).points] == ["1", "2.5"]


def test_a_sweep_of_one_point_stays_a_sweep(tmp_path: Path) -> None:
    """Otherwise a script that reads sweeps would meet another folder layout by surprise."""
    found = load_experiment(write(tmp_path, EXPERIMENT + "sweep: [{label: a, seed: 2}]\n"))
    assert found.is_sweep
    assert [point.experiment.seed for point in found.points] == [2]


def test_a_setting_for_some_points_may_be_unread_by_others(tmp_path: Path) -> None:
    """Otherwise no ideal case could stand in a sweep with a loss given for the rest."""
    text = EXPERIMENT + "network: {loss: 0.01}\n"
    sweep = "sweep: [{label: a, network.engine: ideal}, {label: b, network.engine: packet}]\n"
    assert len(load_experiment(write(tmp_path, text + sweep)).points) == 2


def test_a_setting_that_no_point_reads_is_refused(tmp_path: Path) -> None:
    """Otherwise a user would take a loss for simulated that never was."""
    text = EXPERIMENT + "network: {loss: 0.01, engine: ideal}\nsweep: [{label: a, seed: 2}]\n"
    with pytest.raises(InputError, match=r"tiny.yaml:8: network.loss has no effect"):
        load_experiment(write(tmp_path, text))


def test_intervals_count_reports() -> None:
    """Otherwise a run would end before or after its duration."""
    experiment = Experiment.model_validate(
        {"name": "a", "question": "b", "grid": {"duration": 2.5}, "wams": {"reporting": 30}}
    )
    assert (experiment.rate_hz, experiment.intervals) == (30, 75)


@pytest.mark.parametrize("path", shipped_experiments(), ids=lambda path: path.stem)
def test_every_shipped_experiment_is_sound_and_opens_with_its_question(path: Path) -> None:
    """Otherwise the first command of a newcomer would fail."""
    found = load_experiment(str(path))
    assert found.name == path.stem
    first_line = path.read_text(encoding="utf-8").splitlines()[0]
    assert first_line.startswith("# ")
    assert first_line.endswith("?")
    assert found.question.endswith("?")


@pytest.mark.parametrize("name", ["g26_trip", "g26_trip_beta2"])
def test_the_shipped_sweeps_cover_the_delays_of_the_paper(name: str) -> None:
    """Otherwise the figures could not be compared with the paper's."""
    points = load_experiment(name).points
    assert points[0].experiment.network.engine == "ideal"
    assert [p.experiment.network.mean_delay for p in points[1:]] == [0.1, 0.25, 0.5, 1.0, 1.25]
    assert {p.experiment.grid.pss.gain for p in points} == {9.0}

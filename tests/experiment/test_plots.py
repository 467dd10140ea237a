"""The figures, drawn from synthetic results."""

from pathlib import Path
from xml.etree import ElementTree

import matplotlib.image
import pytest
from matplotlib.figure import Figure

from synthetic_result import CONSTANT, EXPERIMENT, SWEEP, fake_launch, known_sites, plan_of
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.experiment.plots import (
    believing_unit,
    delay_histograms,
    delay_shares,
    draw,
    drawn_unit,
    frequency,
)
from tieline.experiment.results import Run, read_runs
from tieline.experiment.run import execute
from tieline.experiment.sites import Sites

MORE = "  - {label: 1 s, network.engine: constant, network.delay: 1 s}\n"


def runs_of(tmp_path: Path, text: str = EXPERIMENT + SWEEP) -> list[Run]:
    """Return the runs of a synthetic result."""
    return read_runs(execute(plan_of(tmp_path, text), tmp_path / "out", fake_launch))


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (EXPERIMENT + SWEEP + MORE, {"frequency", "voltage", "delays", "overview"}),
        (EXPERIMENT, {"frequency", "voltage", "delays", "average", "overview"}),
    ],
)
def test_every_figure_is_an_svg_and_a_png_of_sensible_size(
    tmp_path: Path, text: str, names: set[str]
) -> None:
    """Otherwise `make demo` would end without the pictures that it promises."""
    paths = draw(tmp_path / "plots", runs_of(tmp_path, text))
    assert {path.stem for path in paths} == names
    for path in paths:
        ElementTree.parse(path.with_suffix(".svg"))
        assert path.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
        height, width, _ = matplotlib.image.imread(path).shape
        assert 600 <= width <= 2400
        assert 400 <= height <= 2400
        assert 10_000 < path.stat().st_size < 1_000_000


def test_a_sweep_without_packets_has_no_delays_to_draw(tmp_path: Path) -> None:
    """Otherwise a study with ideal communication would fail at its last step."""
    text = EXPERIMENT + (
        "wams: {reporting: continuous}\nnetwork: {engine: ideal}\n"
        "sweep: [{label: a, seed: 1}, {label: b, seed: 2}]\n"
    )
    paths = draw(tmp_path / "plots", runs_of(tmp_path, text))
    assert {path.stem for path in paths} == {"frequency", "voltage", "overview"}


def test_each_delay_has_a_curve_and_a_colour_of_its_own(tmp_path: Path) -> None:
    """Otherwise two delays could not be told apart."""
    runs = runs_of(tmp_path, EXPERIMENT + SWEEP + MORE)
    axes = Figure().subplots()
    frequency(axes, runs)
    curves = [line for line in axes.get_lines() if not line.get_label().startswith("_")]
    assert [line.get_label() for line in curves] == ["ideal", "0.25 s", "1 s"]
    assert len({str(line.get_color()) for line in curves}) == 3
    assert axes.get_legend().get_title().get_text() == "mean combined delay"
    assert curves[0].get_ydata()[0] == pytest.approx(60.0)
    assert "Hz" in axes.get_ylabel()
    assert axes.get_xlabel() == "time, s"


def test_of_many_runs_some_are_named_and_some_have_a_histogram(tmp_path: Path) -> None:
    """Otherwise names would cover the curves, and a figure would be as long as the sweep."""
    (run,) = runs_of(tmp_path, EXPERIMENT)
    runs = [Run(run.folder, {**run.manifest, "label": f"{i}"}) for i in range(26)]
    axes = Figure().subplots()
    frequency(axes, runs)
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert len(axes.get_lines()) == 26 + len(run.events())
    assert (len(names), names[0], names[-1]) == (12, "0", "25")
    assert names == sorted(names, key=int)
    figure = delay_histograms(runs)
    assert len(figure.axes) == 24
    assert figure.get_supxlabel() == "combined delay, ms (24 of 26 runs)"


def test_a_sweep_over_something_else_is_not_called_a_delay(tmp_path: Path) -> None:
    """Otherwise a legend of gains would be headed 'delay'."""
    text = EXPERIMENT + (
        "network: {engine: ideal}\n"
        "sweep: [{label: K 5, grid.pss.gain: 5}, {label: K 9, grid.pss.gain: 9}]\n"
    )
    axes = Figure().subplots()
    frequency(axes, runs_of(tmp_path, text))
    assert axes.get_legend().get_title().get_text() == ""


def test_the_share_of_frames_rises_from_nothing_to_all(tmp_path: Path) -> None:
    """Otherwise the delays shown would not be those of every frame."""
    axes = Figure().subplots()
    delay_shares(axes, runs_of(tmp_path))
    (line,) = axes.get_lines()
    assert line.get_ydata()[0] == 0
    assert line.get_ydata()[-1] == pytest.approx(100)
    assert line.get_xdata()[0] >= 0.24


def test_the_bars_of_a_histogram_hold_every_frame(tmp_path: Path) -> None:
    """Otherwise joining bins for drawing would lose frames."""
    figure = delay_histograms(runs_of(tmp_path))
    (axes,) = figure.axes
    heights, edges, _ = axes.patches[0].get_data()
    assert (heights * (edges[1:] - edges[:-1])).sum() == pytest.approx(100)


def test_the_voltage_drawn_is_that_of_the_unit_that_moves_most(tmp_path: Path) -> None:
    """Otherwise the figure would show a unit that nothing happens to, or the one that is gone."""
    run = runs_of(tmp_path, EXPERIMENT)[0]
    assert drawn_unit(run) == "G34"
    assert believing_unit(run) == "G34"


def test_the_case_may_choose_the_unit_drawn(tmp_path: Path) -> None:
    """Otherwise figures of several experiments would show different units."""
    (tmp_path / "tiny.yaml").write_text(EXPERIMENT)
    sites = known_sites()
    plan = prepare(
        load_experiment(str(tmp_path / "tiny.yaml"), CONSTANT),
        lambda *_: Sites(sites.sensors, sites.controllers, plot_unit="G26"),
    )
    (run,) = read_runs(execute(plan, tmp_path / "out", fake_launch))
    assert drawn_unit(run) == "G26"
    assert believing_unit(run) == "G21"

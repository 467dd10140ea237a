"""Sweep blocks: grids, random points and Latin hypercubes."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from synthetic_result import EXPERIMENT
from tieline.errors import InputError
from tieline.experiment.axes import Linspace, common, written
from tieline.experiment.load import Study, load_experiment
from tieline.experiment.sampling import MOST_POINTS
from tieline.experiment.sweep import Point

DRAWN = """\
sweep:
  method: latin_hypercube
  points: 50
  over:
    network.loss: {uniform: [0, 5 %]}
    network.mean_delay: {log_uniform: [150 ms, 1.5 s]}
    network.cross_traffic: {normal: [1, 0.4], within: [0.2, 2]}
    grid.pss.beta1: {choice: [0, 0.5, 1], weights: [1, 1, 2]}
    network.dscp: {integers: [0, 7]}
"""
FIRST = ["3.632 %", "341.7 ms", 1.332, 1, 7]
LAST = ["1.025 %", "1022 ms", 1.028, 1, 4]
GRID = """\
sweep:
  method: grid
  over:
    grid.pss.beta1: {linspace: [0, 1], count: 3}
    network.mean_delay: [200 ms, 1 s]
"""


def study(tmp_path: Path, sweep: str, *settings: str) -> Study:
    """Return the study of a sweep."""
    path = tmp_path / "tiny.yaml"
    path.write_text(EXPERIMENT + sweep, encoding="utf-8")
    return load_experiment(str(path), settings)


def values(points: tuple[Point, ...], key: str) -> list[float]:
    """Return what a setting is in each point."""
    found = []
    for point in points:
        part: object = point.experiment
        for name in key.split("."):
            part = getattr(part, name)
        found.append(part)
    return found  # type: ignore[return-value]


def refusal(tmp_path: Path, sweep: str, *settings: str) -> tuple[str, ...]:
    """Return what is found wrong."""
    with pytest.raises(InputError) as caught:
        study(tmp_path, sweep, *settings)
    return caught.value.findings


def test_a_grid_visits_every_combination(tmp_path: Path) -> None:
    """Otherwise a corner of the study would be missing."""
    points = study(tmp_path, GRID).points
    pairs = zip(values(points, "grid.pss.beta1"), values(points, "network.mean_delay"), strict=True)
    assert list(pairs) == [(b, d) for b in (0.0, 0.5, 1.0) for d in (0.2, 1.0)]
    assert points[3].label == "beta1=0.5, mean_delay=1 s"
    assert points[3].slug == "beta1-0.5-mean-delay-1-s"
    assert points[0].experiment.seed == points[5].experiment.seed


def test_settings_of_one_name_are_told_apart(tmp_path: Path) -> None:
    """Otherwise two columns of a sweep would have one heading."""
    over = "{grid.pss.tuning.G1.K: [1, 2], grid.pss.tuning.G2.K: [1, 2]}"
    points = study(tmp_path, f"sweep: {{method: grid, over: {over}}}\n").points
    assert points[1].label == "G1.K=1, G2.K=2"


def test_the_same_file_gives_the_same_points_anywhere(tmp_path: Path) -> None:
    """Otherwise a Monte-Carlo study could not be repeated; the values are of this version's own.

    Stored output: it only tells of a change.
    """
    first, last = study(tmp_path, DRAWN).points[0], study(tmp_path, DRAWN).points[-1]
    assert [own.value for own in first.overrides] == FIRST
    assert [own.value for own in last.overrides] == LAST
    other = study(tmp_path, DRAWN, "sweep.seed=2").points[0]
    assert [own.value for own in other.overrides] != FIRST


def test_one_setting_more_leaves_the_draws_of_the_others(tmp_path: Path) -> None:
    """Otherwise a study could not be widened and still be compared."""
    fewer = DRAWN.replace("    network.loss: {uniform: [0, 5 %]}\n", "")
    key = "network.mean_delay"
    assert values(study(tmp_path, fewer).points, key) == values(study(tmp_path, DRAWN).points, key)


def test_more_random_points_begin_with_those_before(tmp_path: Path) -> None:
    """Otherwise a study could not be continued with more points."""
    text = DRAWN.replace("latin_hypercube", "random")
    few, many = study(tmp_path, text, "sweep.points=20"), study(tmp_path, text)
    for key in ("network.loss", "grid.pss.beta1", "network.dscp"):
        assert values(few.points, key) == values(many.points, key)[:20]


def test_a_latin_hypercube_has_one_draw_in_each_stratum(tmp_path: Path) -> None:
    """Otherwise it would be no better than plain draws: here are 50 strata of 0.1 % of loss."""
    losses = np.array(values(study(tmp_path, DRAWN).points, "network.loss"))
    # A value on a border may be rounded over it: 4 digits move it by 5e-7 at most.
    strata = np.floor(np.sort(losses) / 0.001 + 1e-3 * np.linspace(-1, 1, 50))
    assert np.abs(strata - np.arange(50)).max() <= 1
    assert np.abs(np.sort(losses) - (np.arange(50) + 0.5) * 0.001).max() <= 0.0005 + 1e-6


def test_distributions_are_what_they_are_called(tmp_path: Path) -> None:
    """Otherwise the spread of a study's results would be that of other causes.

    With strata, mean and share are right to a few per mille of the range; the bounds hold exactly.
    """
    points = study(tmp_path, DRAWN, "sweep.points=400").points
    delays = np.log(values(points, "network.mean_delay"))
    assert delays.mean() == pytest.approx(np.log(0.15 * 1.5) / 2, abs=0.01)
    assert np.exp([delays.min(), delays.max()]) == pytest.approx([0.15, 1.5], rel=0.01)
    traffic = np.array(values(points, "network.cross_traffic"))
    assert 0.2 <= traffic.min() <= traffic.max() <= 2.0
    # The normal's mean cut to [-2, 2.5] deviations: 1 + 0.4 * 0.0369, from phi and Phi of the ends.
    assert traffic.mean() == pytest.approx(1.0151, abs=0.003)
    assert np.bincount(values(points, "network.dscp")).tolist() == [50] * 8
    betas = values(points, "grid.pss.beta1")
    assert [betas.count(beta) for beta in (0.0, 0.5, 1.0)] == [100, 100, 200]


def test_each_point_can_have_its_own_seed(tmp_path: Path) -> None:
    """Otherwise the points of a Monte-Carlo study would share their traffic."""
    points = study(tmp_path, DRAWN, "sweep.own_seeds=true").points
    seeds = values(points, "seed")
    assert len(set(seeds)) == 50
    assert set(values(study(tmp_path, DRAWN).points, "seed")) == {1}
    again = study(tmp_path, DRAWN, "sweep.own_seeds=true", "sweep.points=20").points
    assert values(again, "seed") == seeds[:20]


def test_many_points_have_short_names_that_sort(tmp_path: Path) -> None:
    """Otherwise folders would be listed in another order than points are run."""
    points = study(tmp_path, DRAWN, "sweep.points=120").points
    slugs = [point.slug for point in points]
    assert slugs == sorted(slugs)
    assert (slugs[0], slugs[-1], len(set(slugs))) == ("001", "120", 120)
    assert [point.label for point in points] == slugs


def test_drawn_values_are_short_and_keep_their_unit() -> None:
    """Otherwise a table of a hundred points could not be read."""
    assert written(213.44441, "ms", 150, 1500) == "213.4 ms"
    assert written(0.0312345, "", 0, 1) == 0.03123
    assert written(1.2346, "", 0, 1.2342) == 1.2342
    assert common(["50 ms", "1 s"]) == ([50.0, 1000.0], "ms")
    assert common([0, "5 %"]) == ([0.0, 5.0], "%")


MISTAKES = [
    ("points: 50", "points: 0", "sweep.points must be 1 or more"),
    ("points: 50", "points: 20000", f"sweep.points must be {MOST_POINTS} or less (got 20000)"),
    ("  points: 50\n", "", "sweep must say how many 'points' method latin_hypercube draws"),
    ("method: latin_hypercube", "method: grid", "sweep must not say 'points'"),
    (
        "method: latin_hypercube\n  points: 50",
        "method: grid",
        "must have values for 'network.loss'",
    ),
    ("latin_hypercube", "latin_cube", "sweep.method must be one of grid, random, latin_hypercube"),
    ("points: 50", "point: 50", "unknown key 'point' in sweep (did you mean 'points'?)"),
    ("uniform: [0, 5 %]", "unifrom: [0, 5 %]", "unknown key 'unifrom' in sweep.over.network.loss"),
    ("{uniform: [0, 5 %]}", "5", "sweep.over.network.loss must be a group of keys: uniform or"),
    ("[0, 5 %]", "[0]", "sweep.over.network.loss.uniform must be at least 2 long"),
    ("[0, 5 %]", "[5 %, 0]", "must have a first value below the last (got [5 %, 0])"),
    ("[0, 5 %]", "[1, 5 %]", "must give each value a unit, as one has (got [1, 5 %])"),
    ("[0, 5 %]", "[1 ms, 5 %]", "must hold quantities of one kind (got [1 ms, 5 %])"),
    ("[0, 5 %]", "[0, 5 parsec]", "network.loss.uniform[1] must be a number, or a quantity"),
    ("[150 ms", "[0 ms", "must lie above 0"),
    ("[1, 0.4]", "[1, 0]", "must have a deviation above 0 (got 0)"),
    ("[1, 0.4]", "[9, 0.4]", "at most 4 deviations outside 'within' (got 9)"),
    ("[0.2, 2]", "[2, 2]", "must have a first value below the last in 'within'"),
    ("[1, 1, 2]", "[1, 1]", "one weight for each of the 3 values"),
    ("[0, 0.5, 1]", "[0, 0, 1]", "lists 0 twice"),
    ("[0, 7]", "[0, 7.5]", "integers[1] must be a whole number"),
    ("network.dscp", "network.dcsp", "unknown key 'dcsp' in network (did you mean 'dscp'?)"),
    ("network.dscp", "name", "a sweep point cannot change 'name'"),
    ("[0, 7]", "[0, 70]", "network.dscp must be 63 or less (got"),
    ("0, 5 %", "0, 5 ms", "network.loss must be a share in one of %"),
]


@pytest.mark.parametrize(("old", "new", "words"), MISTAKES, ids=lambda text: str(text)[:30])
def test_a_mistake_in_a_block_is_told_once(tmp_path: Path, old: str, new: str, words: str) -> None:
    """Otherwise one wrong bound of a hundred points would fill the screen."""
    assert DRAWN.count(old) == 1
    (finding,) = refusal(tmp_path, DRAWN.replace(old, new))
    assert words in finding
    line = next(i for i, text in enumerate(DRAWN.splitlines()) if old.split("\n")[0] in text)
    told = int(finding.split(":")[1])
    assert told - len(EXPERIMENT.splitlines()) - 1 in (0, line, line + 1), finding


def test_a_grid_that_is_too_large_is_refused_before_it_is_made(tmp_path: Path) -> None:
    """Otherwise a slip of the pen would fill the memory."""
    axes = ", ".join(f"grid.pss.tuning.G{i}.K: {{linspace: [1, 2], count: 10}}" for i in range(9))
    (finding,) = refusal(tmp_path, f"sweep: {{method: grid, over: {{{axes}}}}}\n")
    assert "must have at most 10000 points (its grid has 1000000000)" in finding


def test_values_that_some_points_cannot_have_are_told_with_their_number(tmp_path: Path) -> None:
    """Otherwise a user would mend one point and find the next."""
    (finding,) = refusal(tmp_path, GRID.replace("[0, 1], count: 3", "[0, 4], count: 5"))
    assert "point 'beta1=2, mean_delay=200 ms': grid.pss.beta1 must be 1 or less" in finding
    assert finding.endswith("(and in 5 more points)")


def test_an_option_cannot_change_what_is_swept(tmp_path: Path) -> None:
    """Otherwise the option would be lost without a word."""
    (finding,) = refusal(tmp_path, GRID, "grid.pss.beta1=1")
    assert "the sweep itself sets grid.pss.beta1" in finding


def test_the_shipped_monte_carlo_study_draws_a_hundred_points() -> None:
    """Otherwise the study that the documentation speaks of would be another."""
    found = load_experiment("monte_carlo")
    assert len(found.points) == 100
    assert len({point.experiment.seed for point in found.points}) == 100
    keys = {".".join(map(str, own.path)) for point in found.points for own in point.overrides}
    assert keys >= {"network.mean_delay", "network.jitter.high", "network.loss"}


@pytest.mark.parametrize(
    ("ends", "count"), [("[59.98, 60.02]", 21), ("[1e6, 1000001]", 11), ("[0, 1]", 5000)]
)
def test_values_that_lie_close_together_stay_apart(ends: str, count: int) -> None:
    """Points that are rounded onto each other would be run twice and look like a plateau."""
    axis = Linspace(linspace=yaml.safe_load(ends), count=count)
    assert len(set(axis.values())) == count
    steps = np.diff(axis.values())
    # Rounding moves each end of a step by at most half of a thousandth of the range, or of a step.
    assert np.allclose(steps, np.mean(steps), rtol=0.6)

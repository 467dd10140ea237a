"""Results side by side, made from formulas: what they say, where they differ, how they look."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from synthetic_result import EXPERIMENT, SWEEP, fake_launch, plan_of
from tieline.compare import commands
from tieline.compare.differences import figures_of, settings_that_differ
from tieline.compare.plots import check_file
from tieline.compare.quantities import chosen
from tieline.compare.select import named, runs_of
from tieline.errors import CosimError, InputError
from tieline.experiment.results import Run
from tieline.experiment.run import execute
from tieline.experiment.sweep_run import PointsFailedError


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a single run `one` and a sweep `many`."""
    folder = tmp_path_factory.mktemp("results")
    execute(plan_of(folder), folder / "one", fake_launch)
    execute(plan_of(folder, EXPERIMENT + SWEEP), folder / "many", fake_launch)
    return folder


@pytest.fixture(scope="module")
def runs(results: Path) -> list[Run]:
    """Return the single run, and the sweep's two."""
    return runs_of([str(results / "one"), str(results / "many")])


def test_a_point_is_found_by_its_folder_or_label(results: Path) -> None:
    """Otherwise a point could not be compared with another sweep's."""
    many = results / "many"
    for reference in (f"{many}:0.25 s", f"{many}:0.25-s", str(many / "points" / "0.25-s")):
        (run,) = runs_of([reference])
        assert run.label == "0.25 s"


def test_one_run_named_twice_is_one(results: Path) -> None:
    """Otherwise a sweep with one of its points would show that point twice."""
    assert len(runs_of([str(results / "many"), f"{results / 'many'}:ideal"])) == 2


def test_a_reference_to_nothing_says_what_there_is(results: Path) -> None:
    """Otherwise a typing mistake would send the user to look into folders."""
    with pytest.raises(
        InputError, match=r"no point 'idel'; did you mean 'ideal'\? \(it has: ideal"
    ):
        runs_of([f"{results / 'many'}:idel"])
    with pytest.raises(InputError, match="is no result"):
        runs_of([str(results)])


def test_an_incomplete_point_is_not_compared(results: Path) -> None:
    """Otherwise the figures of half a run would stand beside those of whole ones."""

    def launch(folder: Path, on_progress: object) -> object:
        raise CosimError("lost")

    with pytest.raises(PointsFailedError):
        execute(plan_of(results, EXPERIMENT + SWEEP), results / "lost", launch)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"lost:ideal is incomplete \(lost\)"):
        runs_of([f"{results / 'lost'}:ideal"])
    with pytest.raises(InputError, match="holds no complete run"):
        runs_of([str(results / "lost")])


def test_names_tell_runs_of_several_folders_apart(runs: list[Run]) -> None:
    """Otherwise two columns would have one heading."""
    assert named(runs) == ["one:tiny", "many:ideal", "many:0.25 s"]
    assert named(runs[1:]) == ["ideal", "0.25 s"]


def test_a_difference_is_against_the_first_run(runs: list[Run]) -> None:
    """Otherwise a sign would be wrong, and worse would look better."""
    rows = {row.figure.name: row for row in figures_of(runs)}
    delay = rows["delay, mean, ms"]
    assert delay.values == pytest.approx((250.0, 0.0, 250.0))
    assert delay.difference(1) == pytest.approx(-250.0)
    assert rows["frequency nadir, Hz"].difference(1) == 0.0


def test_settings_that_differ_are_all_that_is_listed(runs: list[Run]) -> None:
    """Otherwise one would look for the cause among a hundred equal settings."""
    differing = settings_that_differ(runs)
    assert differing == {
        "wams.reporting": [60, "continuous", 60],
        "network.engine": ["constant", "ideal", "constant"],
        "network.delay": [0.25, None, 0.25],
    }
    assert settings_that_differ([runs[0], runs[2]]) == {}


def test_the_tables_of_many_runs_fit_the_width(results: Path, tmp_path: Path) -> None:
    """Otherwise a terminal would break the lines and no column would stand under its name."""
    file = io.StringIO()
    console = Console(file=file, width=60)
    one, many = str(results / "one"), str(results / "many")
    data = commands.compare([one, many], None, tmp_path / "c.svg", console)
    text = file.getvalue()
    table = text[: text.index("plot  ")]
    assert max(len(line) for line in table.splitlines()) <= 60
    assert table.count("one:tiny") > table.count("many:ideal")
    assert "-250.0" in text
    assert data["runs"] == ["one:tiny", "many:ideal", "many:0.25 s"]
    assert data["figures"]["delay, mean, ms"]["differences"] == pytest.approx([0, -250, 0])
    assert (tmp_path / "c.svg").read_text().startswith("<?xml")


def test_one_run_alone_is_no_comparison(results: Path, tmp_path: Path) -> None:
    """Otherwise a table without differences would puzzle its reader."""
    with pytest.raises(InputError, match="needs two runs or more"):
        commands.compare([str(results / "one")], None, tmp_path / "c.png", Console(quiet=True))


def test_an_unknown_unit_gets_the_nearest(runs: list[Run]) -> None:
    """Otherwise one would have to look up the case's names."""
    with pytest.raises(InputError, match="no such unit; did you mean 'G26'"):
        commands.unit_to_draw(runs, "G62")


def test_quantities_go_by_name_pattern_or_kind(runs: list[Run]) -> None:
    """Otherwise thirty names would have to be typed."""
    names = [quantity.name for quantity in chosen(runs[:1], ["vt_pu.G2?", "speed_pu", "coi_pu"])]
    speeds = ["speed_pu.G21", "speed_pu.G26", "speed_pu.G34"]
    assert names == ["vt_pu.G21", "vt_pu.G26", *speeds, "coi_pu"]


def test_a_wrong_quantity_gets_the_nearest_word(runs: list[Run]) -> None:
    """Otherwise one would guess at the names of columns."""
    with pytest.raises(InputError, match=r"(?s)'sped_pu\.G26'; did you mean 'speed_pu\.G26'.*'q'"):
        chosen(runs, ["sped_pu.G26", "q", "coi_pu"])


@pytest.mark.parametrize("name", ["p.png", "p.svg"])
def test_quantities_are_drawn_as_picture_or_vectors(
    results: Path, tmp_path: Path, name: str
) -> None:
    """Otherwise a paper could not use them."""
    begin = {"p.png": b"\x89PNG", "p.svg": b"<?xml"}[name]
    many = str(results / "many")
    drawn = commands.plot(many, ["coi_pu", "speed_pu.G2*"], tmp_path / name, (0.5, 4.0))
    assert drawn.read_bytes().startswith(begin)


def test_a_picture_of_another_format_is_refused() -> None:
    """Otherwise the refusal would come from a library, after the work."""
    with pytest.raises(InputError, match=r"must end in \.png, \.svg, \.pdf"):
        check_file(Path("a.gif"))


def test_a_window_without_time_is_refused(results: Path, tmp_path: Path) -> None:
    """Otherwise an empty picture would be drawn."""
    with pytest.raises(InputError, match="--from 4 must be before --to 2"):
        commands.plot(str(results / "one"), ["coi_pu"], tmp_path / "p.png", (4.0, 2.0))

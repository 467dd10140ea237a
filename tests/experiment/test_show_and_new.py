"""`tieline show`, `new`, `cases` and `schema`."""

import json
import shutil
from pathlib import Path

import jsonschema
import pytest
import yaml
from typer.testing import CliRunner, Result

from tieline import cli
from tieline.experiment.json_schema import json_schema
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.experiment.plan import prepare
from tieline.experiment.show import as_yaml
from tieline.experiment.starter import LARGEST_SHARE, unit_to_trip, write_starter
from tieline.grid.case import load_case
from tieline.resources import case_folder, shipped

NAMES = [path.stem for path in shipped_experiments()]
CASES = [path.parent.name for path in sorted(shipped("cases").glob("*/case.yaml"))]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def call(*arguments: str) -> Result:
    """Return what a command line gives."""
    return CliRunner().invoke(cli.app, list(arguments))


@pytest.mark.parametrize("name", NAMES)
def test_what_is_shown_is_the_same_experiment(name: str, tmp_path: Path) -> None:
    """Otherwise one could not run what one was shown, or would run something else."""
    study = load_experiment(name)
    text = as_yaml(study)
    (tmp_path / "shown.yaml").write_text(text)
    again = load_experiment("shown.yaml")
    assert again.base == study.base
    assert [(p.label, p.experiment) for p in again.points] == [
        (p.label, p.experiment) for p in study.points
    ]
    assert jsonschema.Draft202012Validator(json_schema()).is_valid(yaml.safe_load(text))


def test_show_says_every_default_with_its_unit_and_where_it_comes_from(tmp_path: Path) -> None:
    """Otherwise one would have to know the defaults."""
    (tmp_path / "mine.yaml").write_text("extends: g26_trip_smoke\nname: mine\n")
    result = call("show", "mine.yaml", "--set", "grid.duration=250 ms")
    assert result.exit_code == 0, result.output
    first, second, *rest = result.stdout.splitlines()
    assert first.startswith("# mine: mine.yaml extends ")
    assert second == "# --set grid.duration=250 ms"
    shown = yaml.safe_load("\n".join(rest))
    assert shown["grid"]["duration"] == "0.25 s"
    assert shown["network"]["series_window"] == "0.1 s"
    assert shown["network"]["loss"] is None
    assert "extends" not in shown
    assert shown["grid"]["events"] == [{"at": "1 s", "trip_generator": "G26"}]


def test_show_has_json_for_programs() -> None:
    """Otherwise a script would have to parse text with units."""
    found = json.loads(call("show", "g26_trip", "--json").stdout)
    assert found["experiment"]["grid"]["duration"] == 41.0
    assert found["points"][2] == {
        "label": "0.25 s",
        "slug": "0.25-s",
        "settings": {"network.mean_delay": "250 ms"},
    }


def test_schema_prints_both_forms() -> None:
    """Otherwise the schema could be had from a checkout only."""
    assert json.loads(call("schema").stdout) == json_schema()
    assert call("schema", "--markdown").stdout.startswith("# Every setting of an experiment\n")


@pytest.mark.parametrize("case", CASES)
def test_a_new_experiment_is_valid_as_it_is(case: str, tmp_path: Path) -> None:
    """Otherwise the first file of a newcomer would be refused."""
    path = write_starter("first", case, tmp_path)
    plan = prepare(load_experiment(str(path)))
    assert len(plan.runs) == 1
    data = yaml.safe_load(path.read_text())
    assert jsonschema.Draft202012Validator(json_schema()).is_valid(data)
    (line,) = [line for line in path.read_text().splitlines() if "$schema=" in line]
    assert Path(line.partition("$schema=")[2]).is_file()


@pytest.mark.parametrize("case", CASES)
def test_the_sweep_that_a_new_experiment_proposes_is_valid(case: str, tmp_path: Path) -> None:
    """Otherwise taking away the marks, as the comment says, would end in a message."""
    path = write_starter("first", case, tmp_path)
    head, mark, tail = path.read_text().partition("# sweep:\n")
    path.write_text(head + "".join(line[2:] for line in (mark + tail).splitlines(keepends=True)))
    assert len(prepare(load_experiment(str(path))).runs) == 3


def test_a_new_experiment_overwrites_nothing(tmp_path: Path) -> None:
    """Otherwise a forgotten name would cost a day's work."""
    assert call("new", "first").exit_code == 0
    before = (tmp_path / "first.yaml").read_text()
    result = call("new", "first", "--case", "two_area")
    assert (result.exit_code, "is there already" in result.stderr) == (2, True)
    assert (tmp_path / "first.yaml").read_text() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("a b",), "a name has letters, digits"),
        (("../up",), "a name has letters, digits"),
        (("a", "--case", "minwecc"), "no case 'minwecc'"),
        (("a", "--in", "nowhere"), "nowhere/a.yaml cannot be written"),
    ],
)
def test_a_new_experiment_that_cannot_be_is_refused(arguments: tuple[str, ...], words: str) -> None:
    """Otherwise a slip would end in a traceback."""
    result = call("new", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr


def test_a_case_of_ones_own_is_named_from_where_the_file_stands(tmp_path: Path) -> None:
    """Otherwise the new experiment would not find its case."""
    shutil.copytree(case_folder("two_area"), tmp_path / "mine")
    (tmp_path / "studies").mkdir()
    path = write_starter("first", str(tmp_path / "mine"), tmp_path / "studies")
    assert load_experiment(str(path)).base.case == "../mine"
    assert len(prepare(load_experiment(str(path))).runs) == 1


def test_the_unit_that_trips_is_large_but_not_too_large() -> None:
    """Otherwise the first run of a newcomer would end in a collapse, or show nothing."""
    case = load_case(case_folder("miniwecc"))
    power = dict(zip(case.units, case.buses.p_gen[case.unit_bus].tolist(), strict=True))
    share = power[unit_to_trip(case)] / sum(power.values())
    assert LARGEST_SHARE / 2 < share <= LARGEST_SHARE


def test_cases_lists_sizes_and_networks() -> None:
    """Otherwise one would have to open tables to choose a case."""
    rows = {row["name"]: row for row in json.loads(call("cases", "--json").stdout)}
    assert set(rows) == set(CASES)
    wecc = rows["miniwecc"]
    assert (wecc["buses"], wecc["units"], wecc["sensors"]) == (122, 34, 30)
    assert wecc["networks"] == ["case", "wan"]
    assert rows["two_area"]["networks"] == []
    assert "two-area system" in call("cases").stdout

"""The page, the verdicts and the command, from a few items; and runs made in a worker."""

import csv
import json
import re
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paper.items import Log, broken, item
from scenarios.study import run as launched
from tieline.cli import app
from tieline.errors import InputError, TielineError
from tieline.experiment.results import table_hash
from tieline.paper import Spec
from tieline.paper.catalogue import ITEMS
from tieline.paper.markdown import markdown
from tieline.paper.page import write_page
from tieline.paper.reproduce import (
    Result,
    check_target,
    chosen,
    reproduce,
    save_verdicts,
)
from tieline.paper.runs import Runs

RUN = CliRunner()
SHORT = Spec("two_area_beta1", ("sweep=[]", "grid.duration=1.5 s"))


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reproduction")


@pytest.fixture(scope="module")
def results(target: Path) -> list[Result]:
    """One statement of each verdict, and one that could not be computed."""
    items = [item("good", 1.0), item("near", 1.0, against="so"), item("bad", 2.0), broken("lost")]
    lines: list[str] = []
    with Runs(target / "runs", maker=Log().maker) as runs:
        found = reproduce(items, target, runs, lines.append)
    assert len(lines) == len(items)
    assert lines[0].startswith("[1/4]")
    return found


def test_an_item_that_fails_leaves_the_others_their_verdicts(results: list[Result]) -> None:
    """Four minutes of work must not be lost to one power flow."""
    verdicts = [result.rows[0].verdict.value for result in results]
    assert verdicts == [
        "reproduced",
        "reproduced with a difference",
        "not reproduced",
        "not reproduced",
    ]
    assert [str(result.error) for result in results if result.error] == ["it diverges"]


def test_the_page_opens_from_disk_with_every_figure_in_it(
    results: list[Result], target: Path
) -> None:
    """It is mailed around: nothing may be fetched, nothing be missing."""
    text = write_page(results, target, "a test").read_text(encoding="utf-8")
    assert text.count('src="data:image/png;base64,') == 3
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    assert "it is &lt;about&gt; one" in text
    assert "Not computed: it diverges" in text
    assert text.count('id="good"') == 1
    for name in ("of_good.png", "of_good.svg"):
        assert (target / "figures" / name).stat().st_size > 500
    assert "$" not in text


def test_verdicts_are_written_for_programs(results: list[Result], target: Path) -> None:
    """Whoever compares two versions reads these."""
    save_verdicts(results, target, {"quick": True})
    data = json.loads((target / "verdicts.json").read_text(encoding="utf-8"))
    assert data["counts"] == {
        "reproduced": 1,
        "reproduced with a difference": 1,
        "not reproduced": 2,
    }
    assert data["errors"] == {"lost": "it diverges"}
    assert [row["value"] for row in data["verdicts"]] == [1.0, 1.0, 2.0, None]
    with (target / "verdicts.csv").open(encoding="utf-8", newline="") as file:
        assert [row["id"] for row in csv.DictReader(file)] == ["good", "near", "bad", "lost"]


def test_the_markdown_has_a_table_an_item_and_no_broken_cell(results: list[Result]) -> None:
    """It stands in the documentation as it comes."""
    rows = [line for line in markdown(results).splitlines() if line.startswith("| `")]
    assert len(rows) == 4
    assert {row.count("|") for row in rows} == {8}


def test_each_run_is_made_once_and_two_go_on_at_a_time(tmp_path: Path) -> None:
    """Items share runs, and a machine of two cores is to be full but not more than full."""
    log = Log(threading.Barrier(2))
    specs = [Spec("e", (str(i),)) for i in range(4)]
    with Runs(tmp_path, maker=log.maker) as runs:
        for spec in [*specs, *specs]:
            runs.start(spec)
        for spec in specs:
            with pytest.raises(InputError, match="no result folder"):
                runs.run(spec)
        assert runs.ended == len(runs) == 4
    assert sorted(log.made, key=str) == specs
    assert log.most == 2
    assert all(maker.is_closed for maker in log.makers)


def test_a_run_in_a_worker_is_the_run_of_the_command(tmp_path: Path) -> None:
    """A second way to run a federation must not be a second result; and it says why it cannot."""
    with Runs(tmp_path / "runs") as runs:
        # First, so that both are the same worker's.
        with pytest.raises(TielineError, match="no experiment 'two_area_beta3'"):
            runs.run(Spec("two_area_beta3"))
        found = runs.run(SHORT)
    other = launched(SHORT.experiment, tmp_path / "other", *SHORT.settings, "federation.core=local")
    assert found.is_complete
    for path in other.folder.glob("*.parquet"):
        assert table_hash(found.folder / path.name) == table_hash(path), path.name


def test_the_command_computes_one_item_and_writes_everything(tmp_path: Path) -> None:
    """What a user types."""
    out = tmp_path / "out"
    words = ["reproduce", "--only", "two_area_modes", "--markdown", "--out", str(out)]
    result = RUN.invoke(app, words)
    assert result.exit_code == 0, result.output
    assert "ta-between-hz" in result.output
    names = {path.name for path in out.iterdir()}
    assert names >= {"index.html", "verdicts.json", "verdicts.csv", "verdicts.md", "figures"}
    verdicts = json.loads((out / "verdicts.json").read_text(encoding="utf-8"))["verdicts"]
    by_id = {row["id"]: row for row in verdicts}
    # 0.644 Hz is what the reference has for the published parameters.
    assert "0.644 Hz" in by_id["ta-between-hz"]["why"]
    assert by_id["ta-between-unstable"]["verdict"] == "reproduced"


def test_the_command_lists_its_items() -> None:
    """Nobody knows their names by heart."""
    output = RUN.invoke(app, ["reproduce", "--list"]).output
    assert all(each.id in output for each in ITEMS)


def test_an_unknown_item_and_a_taken_folder_are_refused(tmp_path: Path) -> None:
    """Before anything is computed, and without touching what is there."""
    with pytest.raises(InputError, match="did you mean 'g26_delay'"):
        chosen(ITEMS, ["g26_dela"])
    (tmp_path / "thesis.tex").write_text("x", encoding="utf-8")
    with pytest.raises(InputError, match="no reproduction"):
        check_target(tmp_path)
    with pytest.raises(InputError, match="is a file"):
        check_target(tmp_path / "thesis.tex")

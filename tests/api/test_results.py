"""A result folder as pandas and xarray."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tieline
from synthetic_result import EXPERIMENT, SWEEP, UNITS, fake_launch, plan_of
from tieline.experiment.run import execute

Make = Callable[..., Path]


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("single")
    return execute(plan_of(folder), folder / "result", fake_launch)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("swept")
    return execute(plan_of(folder, EXPERIMENT + SWEEP), folder / "result", fake_launch)


def test_the_grids_table_is_indexed_by_time(single: Path) -> None:
    """Otherwise every plot would need the same line first."""
    grid = tieline.open(single).grid
    assert grid.index.name == "t_s"
    assert grid.index[60] == pytest.approx(1.0)
    assert [c for c in grid if c.startswith("speed_pu.")] == [f"speed_pu.{unit}" for unit in UNITS]


def test_the_other_tables_are_read_by_name(single: Path) -> None:
    """A table that cannot be reached from here would be known to readers of the source alone."""
    result = tieline.open(single)
    assert "delays" in result.tables
    assert len(result.flows) == 6
    assert result.events["what"].to_list() == ["G26 trips"]
    assert list(result.read("grid", "t_s", "coi_pu").columns) == ["t_s", "coi_pu"]
    assert result.summary["packets"]["sent"] == 6000


def test_a_wrong_name_gets_the_nearest_right_one(single: Path) -> None:
    """Otherwise a typing mistake would read as an empty table."""
    result = tieline.open(single)
    with pytest.raises(tieline.InputError, match="did you mean 'flows'"):
        result.read("flow")
    with pytest.raises(tieline.InputError, match=r"did you mean 'speed_pu\.G26'"):
        result.read("grid", "speed_pu.G2")
    with pytest.raises(tieline.InputError, match="no result folder"):
        tieline.open(single / "nowhere")


def test_a_sweep_has_a_row_and_a_result_for_each_point(swept: Path) -> None:
    """Otherwise the points could not be compared, or looked at one by one."""
    result = tieline.open(swept)
    assert list(result.table().index) == ["ideal", "0.25 s"]
    assert result.table()["nadir_hz"].notna().all()
    assert list(result.points) == ["ideal", "0.25 s"]
    assert result.points["0.25 s"].config["network"]["delay"] == 0.25
    with pytest.raises(tieline.InputError, match=r"is a sweep: take one of its points \('ideal'"):
        _ = result.grid


def test_a_single_run_is_its_only_point(single: Path) -> None:
    """One loop then serves runs and sweeps."""
    result = tieline.open(single)
    assert result.points == {"tiny": result}


def test_a_notebook_shows_question_and_table(single: Path, swept: Path) -> None:
    """Otherwise the last line of a cell would show an object's address."""
    assert "Does it hold?" in tieline.open(single)._repr_html_()
    assert "0.25 s" in tieline.open(swept)._repr_html_()
    assert "2 runs in" in repr(tieline.open(swept))


def test_an_incomplete_result_says_so(tmp_path: Path) -> None:
    """A part of a run must never be taken for a whole one."""

    def broken(folder: Path, on_progress: object) -> object:
        raise tieline.CosimError("grid died")

    with pytest.raises(tieline.TielineError):
        execute(plan_of(tmp_path), tmp_path / "r", broken)  # type: ignore[arg-type]
    result = tieline.open(tmp_path / "r")
    assert not result.is_complete
    assert "grid died" in result._repr_html_()
    assert result.table().empty


def test_xarray_has_a_variable_a_quantity_over_time_and_unit(single: Path) -> None:
    """A cube with values under the wrong unit would look as good as a right one."""
    result = tieline.open(single)
    dataset = result.to_xarray()
    assert dict(dataset.sizes) == {"t_s": 2461, "unit": 3}
    for unit in UNITS:
        expected = result.grid[f"speed_pu.{unit}"]
        np.testing.assert_array_equal(dataset["speed_pu"].sel(unit=unit), expected)
    # Only units with a controller have an average: the others are NaN, not another unit's.
    assert np.isnan(dataset["wbar_pu"].sel(unit="G26")).all()
    assert dataset["coi_pu"].dims == ("t_s",)
    assert dataset["speed_pu"].attrs["units"] == "pu"


def test_xarray_puts_the_points_of_a_sweep_side_by_side(swept: Path) -> None:
    """Otherwise a difference between points would need an alignment by hand."""
    result = tieline.open(swept)
    dataset = result.to_xarray()
    assert list(dataset["run"].values) == ["ideal", "0.25 s"]
    for label, point in result.points.items():
        late = dataset["wbar_pu"].sel(run=label, unit="G21")
        np.testing.assert_array_equal(late, point.grid["wbar_pu.G21"])


def test_without_xarray_the_message_says_what_to_install(
    single: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise a traceback out of the package would read like a fault of it."""
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(tieline.InputError, match=r"pip install 'tieline\[xarray\]'"):
        tieline.open(single).to_xarray()

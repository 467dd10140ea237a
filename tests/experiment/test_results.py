"""Reading results, and the hash of a table's content."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from synthetic_result import EXPERIMENT, SWEEP, fake_launch, plan_of
from tieline.errors import InputError
from tieline.experiment.results import is_result, read_json, read_runs, table_hash
from tieline.experiment.run import execute

COLUMNS = {"t_s": [0.0, 0.5, float("nan")], "count": [1, 2, 3], "name": ["a", "b", None]}


def hash_of(path: Path, data: dict[str, object], **options: object) -> str:
    """Return the hash of a table written with some storage options."""
    pq.write_table(pa.table(data), path, **options)
    return table_hash(path)


def test_equal_tables_have_equal_hashes_however_they_are_stored(tmp_path: Path) -> None:
    """Otherwise two identical runs would look different because a file was compressed otherwise."""
    plain = hash_of(tmp_path / "a.parquet", COLUMNS)
    other = hash_of(tmp_path / "b.parquet", COLUMNS, compression="gzip", row_group_size=1)
    assert plain == other


def test_a_null_number_is_a_nan(tmp_path: Path) -> None:
    """Otherwise the same gap would have two hashes."""
    nulls = {**COLUMNS, "t_s": [0.0, 0.5, None]}
    assert hash_of(tmp_path / "a.parquet", COLUMNS) == hash_of(tmp_path / "b.parquet", nulls)


@pytest.mark.parametrize(
    "change",
    [
        {"t_s": [0.0, np.nextafter(0.5, 1), float("nan")]},
        {"count": [1, 2, 4]},
        {"count": np.array([1, 2, 3], dtype=np.int32)},
        {"name": ["a", "b", ""]},
        {"name": ["ab", "", None]},
    ],
)
def test_any_change_of_content_changes_the_hash(tmp_path: Path, change: dict[str, object]) -> None:
    """Otherwise a run that differs in its last bit could pass for the same."""
    changed = {**COLUMNS, **change}
    assert hash_of(tmp_path / "a.parquet", COLUMNS) != hash_of(tmp_path / "b.parquet", changed)


def test_the_order_and_names_of_columns_count(tmp_path: Path) -> None:
    """Otherwise two columns could be exchanged unnoticed."""
    swapped = dict(reversed(COLUMNS.items()))
    renamed = {"time_s" if k == "t_s" else k: v for k, v in COLUMNS.items()}
    hashes = {
        hash_of(tmp_path / f"{i}.parquet", data)
        for i, data in enumerate((COLUMNS, swapped, renamed))
    }
    assert len(hashes) == 3


def test_the_runs_of_a_sweep_come_in_its_order(tmp_path: Path) -> None:
    """Otherwise table and legend would follow the alphabet."""
    folder = execute(plan_of(tmp_path, EXPERIMENT + SWEEP), tmp_path / "out", fake_launch)
    assert [run.label for run in read_runs(folder)] == ["ideal", "0.25 s"]
    assert [run.label for run in read_runs(folder / "points" / "0.25-s")] == ["0.25 s"]


def test_a_folder_without_manifest_is_no_result(tmp_path: Path) -> None:
    """Otherwise a user's folder could be taken for one and replaced."""
    assert not is_result(tmp_path)
    with pytest.raises(InputError, match="is no result folder"):
        read_runs(tmp_path)
    (tmp_path / "manifest.json").write_text('{"format": "something else"}')
    assert not is_result(tmp_path)
    (tmp_path / "manifest.json").write_text("[]")
    assert not is_result(tmp_path)


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    """Otherwise a truncated copy would end in a traceback."""
    path = tmp_path / "summary.json"
    with pytest.raises(InputError, match=r"summary.json: cannot be read"):
        read_json(path)
    path.write_text("{")
    with pytest.raises(InputError, match=r"summary.json: is no JSON"):
        read_json(path)


def test_a_missing_table_has_no_rows(tmp_path: Path) -> None:
    """Otherwise every reader would have to ask first whether a run sent packets."""
    (run,) = read_runs(execute(plan_of(tmp_path), tmp_path / "out", fake_launch))
    assert run.table("packets").empty
    assert run.tripped_units() == {"G26"}
    assert run.events() == [(1.0, "G26 trips")]
    assert run.ending() is None

"""Columns as NumPy's arrays."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.batches import values_of
from tieline.columns import TableFile, Tables

VALUES = {
    pa.float64(): st.floats(allow_nan=False) | st.none(),
    pa.float32(): st.floats(allow_nan=False, width=32) | st.none(),
    pa.int32(): st.integers(-(2**31), 2**31 - 1),
    pa.int64(): st.integers(-(2**53), 2**53) | st.none(),
    pa.bool_(): st.booleans(),
    pa.string(): st.text() | st.none(),
}


@settings(max_examples=30)
@given(st.data())
def test_values_are_those_that_were_stored(data: st.DataObject) -> None:
    """Otherwise a figure, a summary or a hash would be of other numbers than the table has."""
    kind = data.draw(st.sampled_from(list(VALUES)))
    chunks = data.draw(st.lists(st.lists(VALUES[kind]), max_size=3))
    column = pa.chunked_array([pa.array(chunk, kind) for chunk in chunks], kind)
    cut = column.slice(data.draw(st.integers(0, len(column))))
    found = values_of(cut)
    assert found.shape == (len(cut),)
    for value, expected in zip(found, cut.to_pylist(), strict=True):
        is_missing_number = expected is None and kind != pa.string()
        assert np.isnan(value) if is_missing_number else value == expected


@pytest.mark.parametrize("rows", [2, 400_000])
def test_blocks_hold_every_column_once_and_few_values(tmp_path: Path, rows: int) -> None:
    """Otherwise a column of a long run would be left out, or all would be in memory at once."""
    names = [f"vt_pu.G{i}" for i in range(3)]
    table = {name: np.full(rows, float(i)) for i, name in enumerate(names)}
    pq.write_table(pa.table(table), tmp_path / "a.parquet")
    with TableFile(tmp_path / "a.parquet") as file:
        blocks = list(file.blocks(names))
        whole = file.read()
    assert [name for block in blocks for name in block] == names
    assert len(blocks) == (1 if rows == 2 else 3)
    assert all(np.array_equal(whole[name], table[name]) for name in names)


def test_a_table_that_is_kept_open_is_closed_in_the_end(tmp_path: Path) -> None:
    """Otherwise the report of a large sweep would run out of files that may be open."""
    pq.write_table(pa.table({"t_s": [0.0, 1.0]}), tmp_path / "grid.parquet")
    tables = Tables(tmp_path)
    with tables.kept_open():
        with tables.kept_open(), tables.opened("grid") as first:
            pass
        with tables.opened("grid") as again, tables.opened("flows") as missing:
            assert again is first
            assert missing is None
            assert again.read(["t_s"])["t_s"].tolist() == [0.0, 1.0]
    with tables.opened("grid") as later:
        assert later is not first
    with pytest.raises(ValueError, match="closed"):
        first.read()

"""Result tables: what is written is read back, and what a killed process wrote stays readable."""

import errno
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.columns import Columns, TableFile
from tieline.errors import CosimError, NumericalError
from tieline.tables import (
    Column,
    TableStream,
    column_names,
    last_value,
    metadata_of,
    read_table,
    readable_tables,
    salvage,
    stored,
    units_of,
    write_table,
)

COLUMNS = (
    Column("t_s", "s", "time"),
    Column("count", "", "packets so far", "int64"),
    Column("link", "", "name of the link", "str"),
)


def rows_of(start: int, count: int) -> dict[str, np.ndarray]:
    """Return `count` rows that say which row they are."""
    index = np.arange(start, start + count)
    names = np.array([f"link{i % 3}" for i in index], dtype=object)
    return {"t_s": index / 60.0, "count": index, "link": names}


def check_rows(path: Path, count: int) -> None:
    """Assert that the table holds exactly the first `count` rows."""
    table, expected = read_table(path), rows_of(0, count)
    assert list(table.columns) == [column.name for column in COLUMNS]
    assert table["t_s"].to_numpy().tolist() == expected["t_s"].tolist()
    assert table["count"].to_numpy().tolist() == expected["count"].tolist()
    assert table["link"].tolist() == expected["link"].tolist()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 70_000), max_size=4))
def test_rows_come_back_in_order_however_they_were_appended(
    tmp_path_factory: pytest.TempPathFactory, counts: list[int]
) -> None:
    """Otherwise the time series of a run depends on how the federate hands its rows over."""
    path = tmp_path_factory.mktemp("stream") / "links.parquet"
    stream = TableStream(path, COLUMNS, {})
    total = 0
    for count in counts:
        stream.append(rows_of(total, count))
        total += count
    stream.close()
    check_rows(path, total)


def test_closing_leaves_the_parquet_file_alone_in_the_folder(tmp_path: Path) -> None:
    """Otherwise a finished run looks like a crashed one, or its folder holds every table twice."""
    stream = TableStream(tmp_path / "links.parquet", COLUMNS, None)
    stream.append(rows_of(0, 5))
    assert [path.name for path in tmp_path.iterdir()] == ["links.arrows"]
    stream.close()
    stream.close()
    assert [path.name for path in tmp_path.iterdir()] == ["links.parquet"]


def test_appended_arrays_may_be_reused_by_the_caller(tmp_path: Path) -> None:
    """Otherwise an integrator that writes into its own buffer records its last state everywhere."""
    stream = TableStream(tmp_path / "x.parquet", COLUMNS[:1], None)
    buffer = np.array([1.0])
    stream.append({"t_s": buffer})
    buffer[0] = 2.0
    stream.append({"t_s": buffer})
    stream.close()
    assert read_table(tmp_path / "x.parquet")["t_s"].tolist() == [1.0, 2.0]


def test_a_stream_cut_anywhere_keeps_its_whole_batches(tmp_path: Path) -> None:
    """Otherwise a run that dies takes with it what it had already written."""
    stream = TableStream(tmp_path / "links.parquet", COLUMNS, None)
    ends = [0]
    sizes = [(tmp_path / "links.arrows").stat().st_size]
    for _ in range(3):
        stream.append(rows_of(ends[-1], 4))
        stream.flush()
        ends.append(ends[-1] + 4)
        sizes.append((tmp_path / "links.arrows").stat().st_size)
    whole = (tmp_path / "links.arrows").read_bytes()
    assert len(whole) == sizes[-1]
    for cut in range(sizes[0], len(whole) + 1, 7):
        folder = tmp_path / f"cut{cut}"
        folder.mkdir()
        (folder / "links.arrows").write_bytes(whole[:cut])
        assert salvage(folder) == [folder / "links.parquet"]
        assert [path.name for path in folder.iterdir()] == ["links.parquet"]
        written = [end for end, size in zip(ends, sizes, strict=True) if size <= cut]
        check_rows(folder / "links.parquet", written[-1])


def test_a_stream_without_a_whole_schema_is_removed(tmp_path: Path) -> None:
    """Otherwise the launcher stumbles over an empty file while it reports the real failure."""
    (tmp_path / "empty.arrows").write_bytes(b"")
    (tmp_path / "short.arrows").write_bytes(b"\xff\xff\xff\xff\x10")
    assert salvage(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_a_batch_full_reaches_the_file_without_a_flush(tmp_path: Path) -> None:
    """Otherwise memory grows with the length of the run."""
    stream = TableStream(tmp_path / "links.parquet", COLUMNS, None)
    before = (tmp_path / "links.arrows").stat().st_size
    stream.append(rows_of(0, 70_000))
    # two integers or floats of 8 bytes a row, in two batches of 32,768 rows that are full
    assert (tmp_path / "links.arrows").stat().st_size - before > 2 * 32_768 * 16
    stream.close()
    # The file has them in one group: a reader pays for each column of each group.
    assert pq.ParquetFile(tmp_path / "links.parquet").num_row_groups == 1


def test_units_descriptions_and_facts_travel_with_the_table(tmp_path: Path) -> None:
    """Otherwise a reader has to guess what a column is in."""
    stream = TableStream(tmp_path / "links.parquet", COLUMNS, {"case": "miniwecc"})
    stream.close()
    write_table(tmp_path / "small.parquet", COLUMNS, rows_of(0, 3))
    for name in ("links", "small"):
        units = units_of(tmp_path / f"{name}.parquet")
        assert units["t_s"] == ("s", "time")
        assert units["count"] == ("", "packets so far")
    assert metadata_of(tmp_path / "links.parquet")["case"] == "miniwecc"
    assert metadata_of(tmp_path / "small.parquet") == {}
    check_rows(tmp_path / "small.parquet", 3)


def test_nan_is_stored_as_null(tmp_path: Path) -> None:
    """Otherwise 'no value' and 'not a number' cannot be told apart by other readers."""
    write_table(tmp_path / "x.parquet", COLUMNS[:1], {"t_s": [1.0, np.nan]})
    assert pq.read_table(tmp_path / "x.parquet")["t_s"].null_count == 1
    assert np.isnan(read_table(tmp_path / "x.parquet")["t_s"][1])


def test_infinity_is_stored_nowhere(tmp_path: Path) -> None:
    """A table with an infinity in it would spoil every mean that is taken of it."""
    columns = [Column("t_s", "s", "simulated time"), Column("delay_s", "s", "a delay")]
    data = {"t_s": np.array([0.5, 1.0]), "delay_s": np.array([0.1, np.inf])}
    with pytest.raises(NumericalError, match=r"a.parquet: delay_s is not finite .* at t = 1.0 s"):
        write_table(tmp_path / "a.parquet", columns, data)
    stream = TableStream(tmp_path / "b.parquet", columns)
    stream.append({name: values[:1] for name, values in data.items()})
    stream.flush()
    stream.append(data)
    with pytest.raises(NumericalError, match=r"b.parquet: delay_s is not finite .* at t = 1.0 s"):
        stream.flush()
    stream.close()
    assert read_table(tmp_path / "b.parquet")["t_s"].tolist() == [0.5]
    assert not (tmp_path / "a.parquet").exists()


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ({"t_s": np.zeros(2)}, r"missing columns \['count'\], unknown \[\]"),
        ({"t_s": np.zeros(2), "count": np.zeros(2, int), "x": np.zeros(2)}, r"unknown \['x'\]"),
        ({"t_s": np.zeros(2), "count": np.zeros(3, int)}, r"'count': \(3,\)"),
        ({"t_s": np.zeros((2, 1)), "count": np.zeros((2, 1), int)}, r"'t_s': \(2, 1\)"),
    ],
)
def test_rows_that_do_not_fit_the_columns_are_refused(
    tmp_path: Path, rows: dict[str, np.ndarray], message: str
) -> None:
    """Otherwise a misspelt quantity is lost without a word."""
    stream = TableStream(tmp_path / "x.parquet", COLUMNS[:2], None)
    with pytest.raises(ValueError, match=message):
        stream.append(rows)
    with pytest.raises(ValueError, match=message):
        write_table(tmp_path / "y.parquet", COLUMNS[:2], rows)
    stream.close()
    assert len(read_table(tmp_path / "x.parquet")) == 0
    assert not (tmp_path / "y.parquet").exists()


def test_a_float_for_an_integer_column_is_refused(tmp_path: Path) -> None:
    """Otherwise a delay in seconds is cut to zero nanoseconds."""
    stream = TableStream(tmp_path / "x.parquet", COLUMNS[1:2], None)
    with pytest.raises(TypeError, match="same_kind"):
        stream.append({"count": np.array([0.5])})
    with pytest.raises(TypeError, match="same_kind"):
        write_table(tmp_path / "y.parquet", COLUMNS[1:2], {"count": [0.5]})
    stream.close()


def test_a_closed_table_takes_no_rows(tmp_path: Path) -> None:
    """Otherwise rows written after the end vanish."""
    stream = TableStream(tmp_path / "x.parquet", COLUMNS[:1], None)
    stream.close()
    with pytest.raises(ValueError, match=r"x\.parquet is closed"):
        stream.append({"t_s": np.zeros(1)})


def test_columns_need_distinct_names(tmp_path: Path) -> None:
    """Otherwise one of two columns hides the other."""
    with pytest.raises(ValueError, match=r"repeated: \['t_s'\]"):
        TableStream(tmp_path / "x.parquet", (COLUMNS[0], COLUMNS[0]), None)
    with pytest.raises(ValueError, match="needs columns"):
        TableStream(tmp_path / "x.parquet", (), None)


def test_a_long_table_is_read_in_groups_and_by_columns(tmp_path: Path) -> None:
    """Otherwise reading one column of a long run would cost the memory of all of them."""
    columns = [Column("k", "", "row", "int64"), *(Column(f"c{i}", "", "zeros") for i in range(99))]
    stream = TableStream(tmp_path / "wide.parquet", columns, None)
    zeros = {f"c{i}": np.zeros(1000) for i in range(99)}
    for first in range(0, 45_000, 1000):
        stream.append({"k": np.arange(first, first + 1000), **zeros})
    stream.close()
    assert pq.ParquetFile(tmp_path / "wide.parquet").num_row_groups == 18
    assert column_names(tmp_path / "wide.parquet")[:2] == ["k", "c0"]
    only = read_table(tmp_path / "wide.parquet", ["k"])
    assert list(only.columns) == ["k"]
    assert np.array_equal(only["k"], np.arange(45_000))


def no_room(*_: object, **__: object) -> None:
    """Answer as a full disk does."""
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_stream_that_finds_no_room_as_parquet_is_read_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise a full disk would take what was written while there was room."""
    stream = TableStream(tmp_path / "grid.parquet", [Column("t_s", "s", "time")])
    stream.append({"t_s": np.arange(10.0)})
    stream.flush()
    monkeypatch.setattr(pq, "ParquetWriter", no_room)
    with pytest.raises(CosimError, match=r"grid\.parquet cannot be written: No space left"):
        stream.close()
    assert salvage(tmp_path) == []
    [path] = readable_tables(tmp_path)
    assert path == stored(tmp_path / "grid.parquet") == tmp_path / "grid.arrows"
    assert list(read_table(path, ["t_s"])["t_s"]) == list(range(10))
    assert (column_names(path), units_of(path)) == (["t_s"], {"t_s": ("s", "time")})
    assert last_value(path, "t_s") == 9.0


def test_a_table_takes_nothing_after_a_batch_that_found_no_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise rows would follow half a batch, and nothing after it could be read."""
    stream = TableStream(tmp_path / "grid.parquet", [Column("t_s", "s", "time")])
    stream.append({"t_s": np.arange(10.0)})
    stream.flush()
    whole_bytes = (tmp_path / "grid.arrows").stat().st_size

    class Full:
        def write_batch(self, batch: object) -> None:
            with (tmp_path / "grid.arrows").open("ab") as file:
                file.write(b"half a batch")
            no_room()

    monkeypatch.setattr(stream, "_writer", Full())
    stream.append({"t_s": np.arange(3.0)})
    with pytest.raises(CosimError, match="No space left on device"):
        stream.flush()
    assert (tmp_path / "grid.arrows").stat().st_size == whole_bytes
    stream.close()
    [path] = salvage(tmp_path)
    assert len(read_table(path)) == 10


def test_a_table_is_written_without_pandas(tmp_path: Path) -> None:
    """Each federate would wait for that import before its first result is on disk."""
    script = """if True:
        import sys
        from pathlib import Path
        import numpy as np
        from tieline.tables import Column, write_table
        columns = [Column("a", "", "text", "str"), Column("b", "", "flag", "bool")]
        rows = {"a": np.array(["x", None, "\\u00e9"], object), "b": np.array([True, False, True])}
        write_table(Path(sys.argv[1]), columns, rows)
        assert "pandas" not in sys.modules
    """
    path = tmp_path / "table.parquet"
    subprocess.run([sys.executable, "-c", script, str(path)], check=True)
    table = pq.read_table(path)
    assert table["a"].to_pylist() == ["x", None, "\u00e9"]
    assert table["b"].to_pylist() == [True, False, True]


def _values_in(path: Path) -> Columns:
    with TableFile(path) as table:
        return table.read()


def test_values_are_those_of_the_data_frame_in_every_type_and_part(tmp_path: Path) -> None:
    """A run's summary, read so, would otherwise differ from what a user computes from its table."""
    columns = [
        Column("x", "pu", "with gaps"),
        Column("n", "", "number", "int64"),
        Column("small", "", "number", "uint8"),
        Column("flag", "", "truth", "bool"),
        Column("who", "", "name", "str"),
    ]
    stream = TableStream(tmp_path / "some.parquet", columns)
    for start in (0, 7):
        x = np.arange(start, start + 7, dtype=np.float64)
        x[2] = np.nan
        rows = {"x": x, "n": x.size - np.arange(7), "small": np.arange(7, dtype=np.uint8)}
        who = np.array([None, *map(str, range(6))], object)
        stream.append(rows | {"flag": np.arange(7) % 3 == 0, "who": who})
        stream.flush()
    (tmp_path / "open.arrows").write_bytes((tmp_path / "some.arrows").read_bytes())
    stream.close()
    for path in (tmp_path / "some.parquet", tmp_path / "open.arrows"):
        frame, values = read_table(path), _values_in(path)
        assert list(values) == list(frame)
        for name in ("x", "n", "small", "flag"):
            assert values[name].dtype == frame[name].dtype
            np.testing.assert_array_equal(values[name], frame[name].to_numpy())
        assert values["who"].tolist() == [None, *"012345"] * 2


def test_values_of_a_table_without_rows_have_their_types(tmp_path: Path) -> None:
    """A run that ended at once would otherwise end in an error about its empty tables."""
    columns = [Column("x", "pu", "number"), Column("who", "", "name", "str")]
    stream = TableStream(tmp_path / "none.parquet", columns)
    stream.close()
    values = _values_in(tmp_path / "none.parquet")
    assert {name: (len(v), v.dtype) for name, v in values.items()} == {
        "x": (0, np.dtype(float)),
        "who": (0, np.dtype(object)),
    }

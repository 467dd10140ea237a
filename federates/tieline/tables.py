"""Result tables: Parquet files with unit and description on every column, streamed during a run.

A run that is killed leaves an Arrow IPC stream beside its target, readable up to the last whole
batch; `salvage` turns it into Parquet. Parquet itself keeps its index at the end of the file, so an
unfinished Parquet file could not be read at all.
"""

import errno
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import ArrayLike, NDArray

from tieline.batches import batch_of
from tieline.errors import CosimError

if TYPE_CHECKING:
    import pandas as pd

# Arrow's other pools keep what is freed: after a long table was read, 100 MB and more.
pa.set_memory_pool(pa.system_memory_pool())

_STREAM_SUFFIX = ".arrows"
_SUFFIXES = (".parquet", _STREAM_SUFFIX)
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_VALUES_PER_BATCH = 131_072
_MOST_ROWS_PER_BATCH = 32_768
_LEAST_VALUES_PER_ROW_GROUP = 250_000
_INDEX_OVER_VALUE = 87
"""What the index of one column of a row group takes of memory, over what writing one value does."""


@dataclass(frozen=True)
class Column:
    """One column: its unit (`pu`, `Hz`, ...; empty for counts and names) and what it says.

    `dtype` is a NumPy type name, or `str` for text. NaN in a column of floats is stored as null.
    """

    name: str
    unit: str
    description: str
    dtype: str = "float64"


class TableStream:
    """A table that grows by rows: an Arrow IPC stream first, Parquet at `path` once closed.

    Rows are gathered to batches of about a megabyte, and each batch reaches the operating system
    before `append` returns: one batch is the memory held, and the most that a killed process loses.
    Once a batch could not be written the table takes no more, and what was written stays readable.

    Args:
        path: the Parquet file to make; the stream stands beside it with the suffix `.arrows`.
        columns: the table's columns, in order.
        metadata: facts about the whole table, kept in the file's schema.

    Raises:
        ValueError: there is no column, or two have one name.
    """

    def __init__(
        self, path: Path, columns: Sequence[Column], metadata: Mapping[str, str] | None = None
    ) -> None:
        self.path = path
        self._stream_path = path.with_suffix(_STREAM_SUFFIX)
        self._schema = _schema_of(columns, metadata)
        self._capacity = max(1, min(_MOST_ROWS_PER_BATCH, _VALUES_PER_BATCH // len(columns)))
        self._buffers = {
            column.name: np.empty(self._capacity, _numpy_type(column.dtype)) for column in columns
        }
        self._filled = 0
        self._is_open = True
        self._sink = pa.OSFile(str(self._stream_path), "wb")
        self._writer = pa.ipc.new_stream(self._sink, self._schema)
        # Arrow writes the schema with the first batch: an empty one makes the file readable now.
        self._write_batch()

    def append(self, rows: Mapping[str, NDArray[np.generic]]) -> None:
        """Add rows; the arrays are copied.

        A call costs about a microsecond a column however few the rows: hand over many at a time.

        Args:
            rows: one array (m,) for each column, by its name.

        Raises:
            ValueError: a column is missing or unknown, the lengths differ, or the table is closed.
            CosimError: the disk is full, or fails.
            TypeError: an array's type cannot be stored in its column without losing its kind.
        """
        if not self._is_open:
            raise ValueError(f"{self.path.name} is closed: no rows can be added")
        count = _common_length(self.path, self._buffers, rows)
        start = 0
        while start < count:
            taken = min(count - start, self._capacity - self._filled)
            for name, buffer in self._buffers.items():
                target = buffer[self._filled : self._filled + taken]
                np.copyto(target, rows[name][start : start + taken], casting="same_kind")
            self._filled += taken
            start += taken
            if self._filled == self._capacity:
                self._write_batch()

    def flush(self) -> None:
        """Hand every row so far to the operating system."""
        if self._filled:
            self._write_batch()

    def close(self) -> None:
        """Write what is left, make the Parquet file and remove the stream; again does nothing."""
        if not self._is_open:
            return
        self.flush()
        self._is_open = False
        try:
            self._writer.close()
            self._sink.close()
            _to_parquet(self._stream_path, self.path)
        except OSError as error:
            raise _unwritten(self.path, error) from error

    def _write_batch(self) -> None:
        """Write what is gathered.

        Raises:
            NumericalError: a value is infinite.
        """
        arrays = {name: buffer[: self._filled] for name, buffer in self._buffers.items()}
        # Whatever comes of it, these rows are done with: a table is also closed after a failure.
        self._filled = 0
        batch = batch_of(self.path.name, self._schema, arrays)
        whole_bytes = self._sink.tell()
        try:
            self._writer.write_batch(batch)
        except OSError as error:
            self._is_open = False
            # What follows half a batch could not be read.
            os.truncate(self._stream_path, whole_bytes)
            raise _unwritten(self.path, error) from error


def salvage(folder: Path) -> list[Path]:
    """Turn every stream left in `folder` by a killed process into Parquet, and return those files.

    The whole batches before a truncated end are kept. A stream cut before its schema was complete
    holds nothing and is removed. One that finds no room as Parquet stays; `stored` tells of it.
    """
    made = []
    # The smallest first: where room is short, each one that is done makes some.
    streams = sorted(folder.glob(f"*{_STREAM_SUFFIX}"), key=lambda path: path.stat().st_size)
    for stream_path in streams:
        path = stream_path.with_suffix(".parquet")
        try:
            if _to_parquet(stream_path, path):
                made.append(path)
        except OSError as error:
            if error.errno not in _NO_ROOM:
                raise
    return made


def stored(path: Path) -> Path | None:
    """Return where a table is: at `path`, in a stream that found no room there, or nowhere."""
    stream_path = path.with_suffix(_STREAM_SUFFIX)
    return next((each for each in (path, stream_path) if each.is_file()), None)


def readable_tables(folder: Path) -> list[Path]:
    """Return the files of the tables in a folder, one for each, by name."""
    names = {path.stem for suffix in _SUFFIXES for path in folder.glob(f"*{suffix}")}
    found = (stored(folder / f"{name}.parquet") for name in sorted(names))
    return [path for path in found if path is not None]


def read_whole(path: Path, columns: Sequence[str] | None = None) -> Any:
    """Return a table, or some of its columns, as Arrow's; of a stream, its whole batches."""
    if path.suffix != _STREAM_SUFFIX:
        with pq.ParquetFile(path) as table:
            # One thread: several would each keep memory of their own.
            return table.read(None if columns is None else list(columns), use_threads=False)
    with pa.OSFile(str(path), "rb") as source:
        reader = pa.ipc.open_stream(source)
        table = pa.Table.from_batches(_whole_batches(reader), reader.schema)
    return table if columns is None else table.select(list(columns))


def last_value(path: Path, column: str) -> float | None:
    """Return the last row's value of a column, None if there is no row or no such column."""
    if column not in column_names(path):
        return None
    values = read_whole(path, [column]).column(column)
    return None if len(values) == 0 else values[-1].as_py()


def write_table(path: Path, columns: Sequence[Column], data: Mapping[str, ArrayLike]) -> None:
    """Write a small table at once; `path` appears whole or not at all.

    Raises:
        ValueError: a column is missing or unknown, or the lengths differ.
        TypeError: values cannot be stored in their column without losing their kind.
        NumericalError: a value is infinite.
        CosimError: the disk is full, or fails.
    """
    schema = _schema_of(columns, None)
    arrays = {
        column.name: np.asarray(data[column.name]).astype(
            _numpy_type(column.dtype), casting="same_kind"
        )
        for column in columns
        if column.name in data
    }
    extra = {name: np.asarray(values) for name, values in data.items() if name not in arrays}
    _common_length(path, dict.fromkeys(schema.names), {**arrays, **extra})
    part = _part_of(path)
    batch = batch_of(path.name, schema, arrays)
    try:
        pq.write_table(pa.Table.from_batches([batch]), part, compression="zstd")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise _unwritten(path, error) from error


def read_table(path: Path, columns: Sequence[str] | None = None) -> "pd.DataFrame":
    """Return a table, or some of its columns; nulls in a column of floats become NaN."""
    return read_whole(path, columns).to_pandas()


def column_names(path: Path) -> list[str]:
    """Return the names of a table's columns, in order, without reading the columns."""
    return list(_schema_at(path).names)


def units_of(path: Path) -> dict[str, tuple[str, str]]:
    """Return (unit, description) of each column of a table, by its name."""
    return {
        field.name: (field.metadata[b"unit"].decode(), field.metadata[b"description"].decode())
        for field in _schema_at(path)
    }


def metadata_of(path: Path) -> dict[str, str]:
    """Return the facts that a table's schema carries about the whole table."""
    metadata = _schema_at(path).metadata or {}
    return {key.decode(): value.decode() for key, value in metadata.items()}


def _schema_of(columns: Sequence[Column], metadata: Mapping[str, str] | None) -> pa.Schema:
    names = [column.name for column in columns]
    twice = sorted({name for name in names if names.count(name) > 1})
    if not names or twice:
        raise ValueError(f"a table needs columns of distinct names (repeated: {twice})")
    fields = [
        pa.field(
            column.name,
            _arrow_type(column.dtype),
            metadata={"unit": column.unit, "description": column.description},
        )
        for column in columns
    ]
    return pa.schema(fields, metadata=dict(metadata) if metadata else None)


def _numpy_type(dtype: str) -> "np.dtype[np.generic]":
    return np.dtype(object) if dtype == "str" else np.dtype(dtype)


def _arrow_type(dtype: str) -> pa.DataType:
    return pa.string() if dtype == "str" else pa.from_numpy_dtype(np.dtype(dtype))


def _common_length(
    path: Path, expected: Mapping[str, object], rows: Mapping[str, NDArray[np.generic]]
) -> int:
    if expected.keys() != rows.keys():
        missing, unknown = (
            sorted(expected.keys() - rows.keys()),
            sorted(rows.keys() - expected.keys()),
        )
        raise ValueError(f"rows for {path.name}: missing columns {missing}, unknown {unknown}")
    shapes = {name: values.shape for name, values in rows.items()}
    first = next(iter(shapes.values()))
    if len(first) != 1 or any(shape != first for shape in shapes.values()):
        raise ValueError(f"rows for {path.name}: arrays of one length expected, got {shapes}")
    return int(first[0])


def _schema_at(path: Path) -> pa.Schema:
    if path.suffix != _STREAM_SUFFIX:
        return pq.read_schema(path)
    with pa.OSFile(str(path), "rb") as source:
        return pa.ipc.open_stream(source).schema


def _unwritten(path: Path, error: OSError) -> CosimError:
    why = os.strerror(error.errno) if error.errno else str(error)
    return CosimError(f"{path.name} cannot be written: {why}")


def _part_of(path: Path) -> Path:
    return path.with_name(f".{path.name}.part")


def _to_parquet(stream_path: Path, path: Path) -> bool:
    with pa.OSFile(str(stream_path), "rb") as source:
        try:
            reader = pa.ipc.open_stream(source)
        except (pa.ArrowInvalid, OSError):
            reader = None
        if reader is not None:
            # A dictionary of numbers that never repeat costs memory for nothing.
            texts = [field.name for field in reader.schema if field.type == pa.string()]
            most = _values_per_row_group(stream_path.stat().st_size // 8, len(reader.schema))
            try:
                with pq.ParquetWriter(
                    _part_of(path), reader.schema, compression="zstd", use_dictionary=texts
                ) as writer:
                    for group in _row_groups(reader, most):
                        writer.write_table(group)
            except OSError:
                _part_of(path).unlink(missing_ok=True)
                raise
    if reader is not None:
        _part_of(path).replace(path)
    stream_path.unlink()
    return reader is not None


def _values_per_row_group(values: int, columns: int) -> int:
    """Return how many values a row group has, for the least memory while they are written.

    The index of a Parquet file is held until its end: it grows with the number of groups, and what
    is held of the values with their length. The sum is least where both take the same.
    """
    return max(_LEAST_VALUES_PER_ROW_GROUP, math.isqrt(_INDEX_OVER_VALUE * values * columns))


def _row_groups(reader: pa.RecordBatchReader, most: int) -> Iterator[pa.Table]:
    """Yield the rows in few large groups: a reader pays for each column of each group."""
    batches: list[pa.RecordBatch] = []
    values = 0
    for batch in _whole_batches(reader):
        batches.append(batch)
        values += batch.num_rows * batch.num_columns
        if values >= most:
            yield pa.Table.from_batches(batches)
            batches, values = [], 0
    if batches:
        yield pa.Table.from_batches(batches)


def _whole_batches(reader: pa.RecordBatchReader) -> Iterator[pa.RecordBatch]:
    while True:
        try:
            batch = reader.read_next_batch()
        except (StopIteration, pa.ArrowInvalid, OSError):
            return
        if batch.num_rows:
            yield batch

"""Reads columns of tables as NumPy's arrays: pandas, half a second to import, is not needed."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from tieline.tables import read_whole

Columns = dict[str, NDArray[Any]]
"""The values (rows,) of some columns by their names; texts are objects."""

_VALUES_AT_ONCE = 300_000


def values_of(column: Any) -> NDArray[Any]:
    """Return the values of an Arrow array, or of one in chunks.

    Null is NaN, which makes floats of integers, and None among texts.
    """
    if isinstance(column, pa.ChunkedArray):
        parts = [values_of(chunk) for chunk in column.chunks]
        # Without any chunk there is still a type.
        return np.concatenate(parts or [values_of(pa.nulls(0, column.type))])
    kind = column.type
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
        return np.array(column.to_pylist(), bool if pa.types.is_boolean(kind) else object)
    rows = slice(column.offset, column.offset + len(column))
    is_valid, data = column.buffers()
    if data is None:
        return np.zeros(0, kind.to_pandas_dtype())
    values = np.frombuffer(data, kind.to_pandas_dtype())[rows]
    if not column.null_count:
        return values
    bits = np.unpackbits(np.frombuffer(is_valid, np.uint8), bitorder="little")[rows]
    return np.where(bits, values, values.dtype.type(np.nan) if values.dtype.kind == "f" else np.nan)


def read_columns(path: Path, names: Sequence[str] | None = None) -> Columns:
    """Return a table, or some of its columns."""
    return _columns_of(read_whole(path, names))


def read_blocks(path: Path, names: Sequence[str]) -> Iterator[Columns]:
    """Yield some columns of a table, as many at a time as are a few MB."""
    if path.suffix != ".parquet":
        # What the disk had no room to turn into Parquet.
        for name in names:
            yield read_columns(path, [name])
        return
    with pq.ParquetFile(path) as table:
        at_once = max(1, _VALUES_AT_ONCE // max(1, table.metadata.num_rows))
        for first in range(0, len(names), at_once):
            some = list(names[first : first + at_once])
            yield _columns_of(table.read(some, use_threads=False))


def _columns_of(table: Any) -> Columns:
    return {name: values_of(table.column(name)) for name in table.column_names}

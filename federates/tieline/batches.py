"""Columns of NumPy arrays as one batch of rows that Arrow writes, and back."""

from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from tieline.errors import NumericalError


def batch_of(
    name: str, schema: pa.Schema, arrays: Mapping[str, NDArray[np.generic]]
) -> pa.RecordBatch:
    """Return the rows that some columns make, as Arrow has them.

    Args:
        name: of the table.
        schema: its columns.
        arrays: (rows,) each column's values, of the type that NumPy has for the column's.

    Raises:
        NumericalError: a value is infinite.
    """
    made: dict[str, pa.Array] = {}
    for dtype in dict.fromkeys(values.dtype for values in arrays.values()):
        some = {column: v for column, v in arrays.items() if v.dtype == dtype}
        joined = np.concatenate(list(some.values()))
        if dtype.kind == "f" and np.isinf(joined).any():
            _refuse_infinity(name, some, arrays.get("t_s"))
        # One array that is cut costs a fifth of an array for each of hundreds of columns.
        whole = _array(schema.field(next(iter(some))).type, joined)
        rows = len(joined) // len(some)
        made |= {column: whole.slice(i * rows, rows) for i, column in enumerate(some)}
    return pa.RecordBatch.from_arrays([made[column] for column in schema.names], schema=schema)


def values_of(column: pa.ChunkedArray) -> NDArray[Any]:
    """Return a column as NumPy has it, NaN for null; texts as objects.

    The inverse of what `batch_of` does. Its own `to_numpy` would import pandas.
    """
    chunks = [_values(chunk) for chunk in column.chunks]
    if len(chunks) == 1:
        return chunks[0]
    return np.concatenate([np.empty(0, column.type.to_pandas_dtype()), *chunks])


def _refuse_infinity(
    name: str, arrays: Mapping[str, NDArray[Any]], t_s: NDArray[Any] | None
) -> NoReturn:
    """Name the first value of columns (rows,) that is infinite, with its time if that is known."""
    column = next(column for column, values in arrays.items() if np.isinf(values).any())
    row = int(np.argmax(np.isinf(arrays[column])))
    when = f" in row {row}" if t_s is None else f" at t = {t_s[row]} s"
    raise NumericalError(f"{name}: {column} is not finite ({arrays[column][row]}){when}")


def _array(kind: pa.DataType, values: NDArray[np.generic]) -> pa.Array:
    """Return values as Arrow has them, NaN as null.

    `pa.array` would do as much, but imports pandas for it, half a second in a federate.
    """
    if pa.types.is_string(kind):
        texts = pa.lib.StringBuilder()
        texts.append_values(values.tolist())
        return texts.finish()
    if pa.types.is_boolean(kind):
        bits = pa.py_buffer(np.packbits(values.astype(bool), bitorder="little"))
        return pa.Array.from_buffers(kind, len(values), [None, bits], 0)
    data = np.ascontiguousarray(values, kind.to_pandas_dtype())
    valid, nulls = None, 0
    if pa.types.is_floating(kind):
        is_missing = np.isnan(data)
        nulls = int(is_missing.sum())
        if nulls:
            valid = pa.py_buffer(np.packbits(~is_missing, bitorder="little"))
    return pa.Array.from_buffers(kind, len(data), [valid, pa.py_buffer(data)], nulls)


def _values(array: pa.Array) -> NDArray[Any]:
    if pa.types.is_string(array.type):
        return np.array(array.to_pylist(), dtype=object)
    span = slice(array.offset, array.offset + len(array))
    valid, data = array.buffers()
    kind = np.dtype(array.type.to_pandas_dtype())
    if data is None:
        return np.empty(0, kind)
    if pa.types.is_boolean(array.type):
        return _bits(data, span).astype(kind)
    values: NDArray[Any] = np.frombuffer(data, kind, span.stop)[span]
    return values if array.null_count == 0 else np.where(_bits(valid, span), values, np.nan)


def _bits(buffer: pa.Buffer, span: slice) -> NDArray[np.bool_]:
    bits = np.unpackbits(np.frombuffer(buffer, np.uint8), count=span.stop, bitorder="little")
    return bits[span].astype(bool)

"""Makes Arrow arrays of NumPy arrays without pandas, which takes half a second to import."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray


def array(kind: pa.DataType, values: NDArray[np.generic]) -> pa.Array:
    """Return values as Arrow has them, NaN and None as null.

    `pa.array` would do as much, but imports pandas for it, whatever it is given.
    """
    if pa.types.is_string(kind):
        return _strings(values.tolist())
    if pa.types.is_boolean(kind):
        return pa.Array.from_buffers(kind, len(values), [None, _bits(values.astype(np.bool_))], 0)
    data = np.ascontiguousarray(values, kind.to_pandas_dtype())
    valid, nulls = None, 0
    if pa.types.is_floating(kind):
        is_missing = np.isnan(data)
        nulls = int(is_missing.sum())
        valid = _bits(~is_missing) if nulls else None
    return pa.Array.from_buffers(kind, len(data), [valid, pa.py_buffer(data)], nulls)


def _strings(values: Sequence[Any]) -> pa.Array:
    is_text = np.array([value is not None and value == value for value in values], np.bool_)
    parts = [
        str.encode(value) if is_told else b""
        for value, is_told in zip(values, is_text, strict=True)
    ]
    ends = np.cumsum([0, *map(len, parts)], dtype=np.int32)
    nulls = len(values) - int(is_text.sum())
    buffers = [_bits(is_text) if nulls else None, pa.py_buffer(ends), pa.py_buffer(b"".join(parts))]
    return pa.Array.from_buffers(pa.string(), len(values), buffers, nulls)


def _bits(flags: NDArray[np.bool_]) -> pa.Buffer:
    return pa.py_buffer(np.packbits(flags, bitorder="little"))

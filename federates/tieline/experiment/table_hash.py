"""The hash of what a table says, worked out in parts: a table may exceed the memory."""

import hashlib
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tieline.batches import values_of
from tieline.tables import read_whole

Parts = Iterable[pa.ChunkedArray]

_VALUES_AT_ONCE = 500_000
_TEXTS_AT_ONCE = 10_000


def table_hash(path: Path) -> str:
    """Return the SHA-256 of what a table says: names, types and values of its columns, in order.

    Row groups, compression and metadata do not enter, so tables with equal content have equal
    hashes. A null in a column of numbers counts as NaN.
    """
    digest = hashlib.sha256()
    if path.suffix == ".parquet":
        with pq.ParquetFile(path) as table:
            _take_in(digest, table.metadata.num_rows, _columns(table))
    else:
        # What the disk had no room to turn into Parquet.
        whole = read_whole(path)
        _take_in(digest, len(whole), ((field, [whole[field.name]]) for field in whole.schema))
    return digest.hexdigest()


def _take_in(digest: "hashlib._Hash", rows: int, columns: Iterable[tuple[pa.Field, Parts]]) -> None:
    for field, parts in columns:
        digest.update(f"{field.name}\n{field.type}\n{rows}\n".encode())
        if pa.types.is_string(field.type):
            _hash_texts(digest, parts)
        else:
            _hash_numbers(digest, parts)


def _columns(table: pq.ParquetFile) -> Iterator[tuple[pa.Field, Parts]]:
    """Yield every column with its values in parts, few at a time."""
    rows = table.metadata.num_rows
    at_once = _VALUES_AT_ONCE // max(rows, 1)
    if at_once == 0:
        for field in table.schema_arrow:
            groups = range(table.num_row_groups)
            yield field, (table.read_row_group(g, [field.name]).column(0) for g in groups)
        return
    fields = list(table.schema_arrow)
    for first in range(0, len(fields), at_once):
        some = fields[first : first + at_once]
        block = table.read([field.name for field in some])
        for field in some:
            yield field, [block.column(field.name)]


def _hash_texts(digest: "hashlib._Hash", parts: Parts) -> None:
    """Take in texts as one JSON list of them all."""
    between = "["
    for chunk in (chunk for part in parts for chunk in part.chunks if len(chunk)):
        for first in range(0, len(chunk), _TEXTS_AT_ONCE):
            texts = chunk.slice(first, _TEXTS_AT_ONCE).to_pylist()
            digest.update(f"{between}{json.dumps(texts)[1:-1]}".encode())
            between = ", "
    digest.update(b"[]" if between == "[" else b"]")


def _hash_numbers(digest: "hashlib._Hash", parts: Parts) -> None:
    for part in parts:
        values = values_of(part)
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), np.nan, values).astype(values.dtype)
        digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())

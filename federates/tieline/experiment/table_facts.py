"""What a manifest says of a result's tables: their content hashes, and how far they reach."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from tieline.tables import last_value, read_whole, readable_tables
from tieline.units import NS_PER_S

_GROWING = {
    "grid": ("t_s", 1),
    "packets": ("ended_ns", NS_PER_S),
    "link_series": ("t_s", 1),
    "controller_series": ("t_s", 1),
}
"""Tables that grow while a run goes on: the column with the instant, and what divides it to s."""


def table_facts(folder: Path) -> dict[str, Any]:
    """Return `tables` (the hash of each), `tables_until_s` and `last_valid_s`, the least of those.

    The last valid instant is None where nothing was recorded of the grid.
    """
    paths = readable_tables(folder)
    until_s = {}
    for path in paths:
        column, per_s = _GROWING.get(path.stem, (None, 1))
        last = None if column is None else last_value(path, column)
        if last is not None:
            until_s[path.stem] = last / per_s
    return {
        "tables": {path.name: table_hash(path) for path in paths},
        "tables_until_s": until_s,
        "last_valid_s": min(until_s.values()) if "grid" in until_s else None,
    }


def table_hash(path: Path) -> str:
    """Return the SHA-256 of what a table says: names, types and values of its columns, in order.

    Row groups, compression and metadata do not enter, so tables with equal content have equal
    hashes. A null in a column of numbers counts as NaN.
    """
    digest = hashlib.sha256()
    table = read_whole(path)
    for name in table.column_names:
        column = table.column(name)
        digest.update(f"{name}\n{column.type}\n{len(column)}\n".encode())
        values = column.to_numpy()
        if values.dtype == object:
            texts = [None if value is None else str(value) for value in values]
            digest.update(json.dumps(texts).encode())
            continue
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), np.nan, values).astype(values.dtype)
        digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()

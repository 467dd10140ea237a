"""What a manifest says of a result's tables: their content hashes, and how far they reach."""

from pathlib import Path
from typing import Any

from tieline.experiment.table_hash import table_hash
from tieline.tables import last_value, readable_tables
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

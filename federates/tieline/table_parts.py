"""Reads tables in parts, for those that may be larger than the memory they should take."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from tieline.tables import read_whole


def parts(path: Path, columns: Sequence[str]) -> Iterator[pa.Table]:
    """Yield some columns of a table as Arrow's, one row group after the other."""
    if path.suffix != ".parquet":
        # What the disk had no room to turn into Parquet.
        yield read_whole(path, columns)
        return
    with pq.ParquetFile(path) as table:
        for group in range(table.num_row_groups):
            yield table.read_row_group(group, list(columns), use_threads=False)

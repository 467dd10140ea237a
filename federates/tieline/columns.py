"""Reads columns of tables as NumPy's arrays: pandas, half a second to import, is not needed."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Self

import pyarrow.parquet as pq
from numpy.typing import NDArray

from tieline.batches import values_of
from tieline.tables import column_names, read_whole, stored

Columns = dict[str, NDArray[Any]]
"""The values (rows,) of some columns by their names: NaN for null, and texts as objects."""

_VALUES_AT_ONCE = 300_000


class TableFile:
    """A table that is open for several readings: to open a wide one takes as long as to read it.

    It is closed at the end of a `with`, or when nobody holds it any more.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        # A stream is what the disk had no room to turn into Parquet.
        self._parquet = pq.ParquetFile(path) if path.suffix == ".parquet" else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._parquet is not None:
            self._parquet.close()

    def names(self) -> list[str]:
        """Return the names of the columns."""
        if self._parquet is None:
            return column_names(self._path)
        return list(self._parquet.schema_arrow.names)

    def read(self, names: Sequence[str] | None = None) -> Columns:
        """Return all columns, or some."""
        if self._parquet is None:
            return _columns_of(read_whole(self._path, names))
        # One thread: several would each keep memory of their own.
        return _columns_of(self._parquet.read(names and list(names), use_threads=False))

    def blocks(self, names: Sequence[str]) -> Iterator[Columns]:
        """Yield some columns, as many at a time as are a few MB."""
        rows = _VALUES_AT_ONCE if self._parquet is None else self._parquet.metadata.num_rows
        at_once = max(1, _VALUES_AT_ONCE // max(1, rows))
        for first in range(0, len(names), at_once):
            yield self.read(names[first : first + at_once])

    def parts(self, names: Sequence[str]) -> Iterator[Any]:
        """Yield some columns as Arrow's tables, one row group after the other."""
        if self._parquet is None:
            yield read_whole(self._path, names)
            return
        for group in range(self._parquet.num_row_groups):
            yield self._parquet.read_row_group(group, list(names), use_threads=False)


class Tables:
    """The tables of a folder, by their names (`grid`, `flows`, ...)."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, list[str]] = {}
        self._open: dict[str, TableFile] = {}
        self._stack: ExitStack | None = None

    def path(self, name: str) -> Path | None:
        """Return the file of a table; None if it was not written."""
        return stored(self._folder / f"{name}.parquet")

    def names(self, name: str) -> list[str]:
        """Return the names of a table's columns; none if it was not written."""
        if name not in self._names:
            with self.opened(name) as table:
                self._names[name] = [] if table is None else table.names()
        return self._names[name]

    @contextmanager
    def kept_open(self) -> Iterator[None]:
        """Leave every table that is read open until the end of the outermost `with`."""
        if self._stack is not None:
            yield
            return
        try:
            with ExitStack() as self._stack:
                yield
        finally:
            self._stack = None
            self._open.clear()

    @contextmanager
    def opened(self, name: str) -> Iterator[TableFile | None]:
        """Give a table, or None if it was not written."""
        path = self.path(name)
        if path is None:
            yield None
        elif self._stack is None:
            with TableFile(path) as table:
                yield table
        else:
            if name not in self._open:
                self._open[name] = self._stack.enter_context(TableFile(path))
            yield self._open[name]


def _columns_of(table: Any) -> Columns:
    return {name: values_of(table.column(name)) for name in table.column_names}

"""Reads the network's series, which have a row for each window and link or controller, in parts.

The series of a long run have millions of rows. One quantity of all of them, as a matrix, takes a
tenth of what the table does.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from tieline.batches import values_of
from tieline.columns import TableFile

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]


class Windowed:
    """A table with an instant `t_s` and keys in each row, one quantity of which is read at a time.

    It stays open as long as it is used.

    Args:
        path: the table; None is one without rows.
        keys: the columns of text that tell rows of one instant apart.

    Attributes:
        keys: the keys (n,) that have a row, in the order of their first.
        windows: the instants (m,) that have a row, s, ascending.
    """

    def __init__(self, path: Path | None, *keys: str) -> None:
        self._table = None if path is None else TableFile(path)
        self.keys: list[tuple[str, ...]] = []
        numbers: dict[tuple[str, ...], int] = {}
        found = [(_instants(part), _numbered(part, keys, numbers)) for part in self._parts(*keys)]
        self.keys = list(numbers)
        instants = [at_s for at_s, _ in found]
        self.windows = np.unique(np.concatenate([np.zeros(0), *instants]))
        self._keys = [rows for _, rows in found]
        self._at = [np.searchsorted(self.windows, at_s).astype(np.int32) for at_s in instants]

    def matrix(
        self,
        column: str,
        missing: float = np.nan,
        windows: Floats | None = None,
        only: Sequence[int] | None = None,
    ) -> Floats:
        """Return a quantity (n, m), a row for each key.

        Args:
            column: its name.
            missing: the value where there is no row; where a row has no value there is NaN.
            windows: the instants (m,) of its columns, if not its own: all of those and others.
            only: the places in `keys` of those that have a row, if not all.
        """
        chosen = np.arange(len(self.keys)) if only is None else np.asarray(only, np.intp)
        row_of = np.full(len(self.keys), -1)
        row_of[chosen] = np.arange(len(chosen))
        own = np.arange(len(self.windows))
        if windows is not None:
            own = np.searchsorted(windows, self.windows)
        width = len(self.windows if windows is None else windows)
        values = np.full((len(chosen), width), missing)
        for part, keys, at in zip(self._parts(column), self._keys, self._at, strict=True):
            rows = row_of[keys]
            here = rows >= 0
            values[rows[here], own[at[here]]] = values_of(part.column(column))[here]
        return values

    def totals(self, column: str) -> Floats:
        """Return the sum (n,) of a quantity over all windows, for each key."""
        sums = np.zeros(len(self.keys))
        for part, keys in zip(self._parts(column), self._keys, strict=True):
            sums += np.bincount(keys, values_of(part.column(column)), len(sums))
        return sums

    def _parts(self, *columns: str) -> Iterator[pa.Table]:
        if self._table is not None:
            yield from self._table.parts(("t_s", *columns))


def _instants(part: pa.Table) -> Floats:
    return np.asarray(values_of(part.column("t_s")), np.float64)


def _numbered(part: pa.Table, keys: Sequence[str], numbers: dict[tuple[str, ...], int]) -> Integers:
    """Return the number of each row's keys; new ones are added to `numbers`."""
    encoded = [part.column(key).combine_chunks().dictionary_encode() for key in keys]
    texts = [one.dictionary.to_pylist() for one in encoded]
    shape = tuple(max(1, len(text)) for text in texts)
    codes = np.ravel_multi_index(
        [values_of(pa.chunked_array([one.indices])) for one in encoded], shape
    )
    distinct, first, inverse = np.unique(codes, return_index=True, return_inverse=True)
    number_of = np.zeros(len(distinct), np.int32)
    for which in np.argsort(first):
        places = np.unravel_index(distinct[which], shape)
        key = tuple(text[place] for text, place in zip(texts, places, strict=True))
        number_of[which] = numbers.setdefault(key, len(numbers))
    return number_of[inverse]

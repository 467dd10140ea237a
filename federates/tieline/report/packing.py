"""Packs curves for a page: thinned without losing an extreme, rounded to 16 bits, compressed."""

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MISSING = 65535
"""The code of a value that is not there."""

_VALUES_AT_ONCE = 300_000

MOST_INSTANTS = 6000
"""Of a curve in a page; above, two stand for each interval."""


def thinned(time_s: Floats, rows: Floats, most: int = MOST_INSTANTS) -> tuple[Floats, Floats]:
    """Return at most `most` instants, and the least and the greatest value around each pair.

    The instants are cut into equal intervals. Each keeps its first and last instant, with the
    least and the greatest value of each curve in the order in which they occur: every extreme
    stays, at most one interval from its place.

    Args:
        time_s: (m,) instants.
        rows: (n, m) curves; NaN where there is no value.
        most: at least 2.
    """
    count = len(time_s)
    if count <= most:
        return time_s, rows
    length = -(-count // (most // 2))
    starts = np.arange(0, count, length)
    last = np.minimum(starts + length, count) - 1
    instants = np.stack([time_s[starts], time_s[last]], axis=1).ravel()
    # A few rows at a time: what it takes beside them is several times their size.
    at_once = max(1, _VALUES_AT_ONCE // count)
    blocks = [_extremes(rows[i : i + at_once], length) for i in range(0, len(rows), at_once)]
    return instants, np.concatenate([np.zeros((0, len(instants))), *blocks])


def _extremes(rows: Floats, length: int) -> Floats:
    """Return the least and the greatest value of each so many, as they follow each other."""
    count = rows.shape[1]
    starts = np.arange(0, count, length)
    padded = np.full((len(rows), len(starts) * length), np.nan)
    padded[:, :count] = rows
    parts = padded.reshape(len(rows), len(starts), length)
    empty = np.isnan(parts).all(axis=2)
    low_at = np.argmin(np.where(np.isnan(parts), np.inf, parts), axis=2)
    high_at = np.argmax(np.where(np.isnan(parts), -np.inf, parts), axis=2)
    first = np.minimum(low_at, high_at)[..., None]
    second = np.maximum(low_at, high_at)[..., None]
    kept = np.empty((len(rows), len(starts), 2))
    kept[..., 0] = np.take_along_axis(parts, first, axis=2)[..., 0]
    kept[..., 1] = np.take_along_axis(parts, second, axis=2)[..., 0]
    kept[empty] = np.nan
    return kept.reshape(len(rows), 2 * len(starts))


def packed(rows: Floats) -> dict[str, Any]:
    """Return curves as the page's `unpack.js` reads them.

    Each curve is rounded to 65,534 steps of its own range; whole numbers of a smaller range stay
    exact. Differences of successive codes, low bytes before high bytes, are compressed (zlib) and
    written as base64.

    Args:
        rows: (n, m) curves; NaN where there is no value.
    """
    rows = np.asarray(rows, np.float64)
    steps = np.zeros(rows.shape, "<u2")
    # Row by row: all of them would take several times their size at once.
    scales = [_steps(row, into) for row, into in zip(rows, steps, strict=True)]
    planes = steps.view(np.uint8).reshape(-1, 2).T
    return {
        "rows": rows.shape[0],
        "length": rows.shape[1],
        "low": [low for low, _ in scales],
        "step": [step for _, step in scales],
        "data": base64.b64encode(zlib.compress(planes.tobytes(), 6)).decode(),
    }


def _steps(row: Floats, into: NDArray[np.uint16]) -> tuple[float, float]:
    """Write the differences of a curve's codes; return the value of code 0, and that of a step."""
    values = row[~np.isnan(row)]
    low = float(values.min()) if values.size else 0.0
    span = float(values.max()) - low if values.size else 0.0
    is_whole = bool(np.all(values == np.round(values))) and span < MISSING
    step = 1.0 if is_whole or span == 0.0 else span / (MISSING - 1)
    codes = np.where(np.isnan(row), MISSING, np.round((row - low) / step)).astype(np.uint16)
    into[:] = np.diff(codes, prepend=np.zeros(1, np.uint16))
    return low, step

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
    differences = np.zeros(rows.shape, "<u2")
    lows, steps = np.zeros(len(rows)), np.ones(len(rows))
    # A few rows at a time: what it takes beside them is several times their size.
    at_once = max(1, _VALUES_AT_ONCE // max(1, rows.shape[1]))
    for i in range(0, len(rows), at_once):
        some = slice(i, i + at_once)
        codes, lows[some], steps[some] = _codes(rows[some])
        differences[some] = np.diff(codes, axis=1, prepend=np.zeros((len(codes), 1), np.uint16))
    planes = differences.view(np.uint8).reshape(-1, 2).T
    return {
        "rows": rows.shape[0],
        "length": rows.shape[1],
        "low": lows.tolist(),
        "step": steps.tolist(),
        "data": base64.b64encode(zlib.compress(planes.tobytes(), 6)).decode(),
    }


def _codes(rows: Floats) -> tuple[NDArray[np.uint16], Floats, Floats]:
    """Return the codes (n, m) of some curves, the value (n,) of code 0 and that (n,) of a step."""
    missing = np.isnan(rows)
    is_known = ~missing.all(axis=1)
    low, high = (
        np.where(is_known, least.reduce(rows, axis=1, initial=np.nan), 0.0)
        for least in (np.fmin, np.fmax)
    )
    span = high - low
    is_whole = (missing | (rows == np.round(rows))).all(axis=1) & (span < MISSING)
    step = np.where(is_whole | (span == 0.0), 1.0, span / (MISSING - 1))
    codes = np.round((rows - low[:, None]) / step[:, None])
    return np.where(missing, MISSING, codes).astype(np.uint16), low, step

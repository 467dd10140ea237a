"""Curves survive the way into a page: rounded as said, with every extreme."""

import base64
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tieline.report.packing import MISSING, packed, thinned


def unpacked(table: dict[str, Any]) -> np.ndarray:
    """Return the curves as the page's own code reads them."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(table["data"])), np.uint8)
    low_bytes, high_bytes = planes.reshape(2, table["rows"], table["length"]).astype(np.int64)
    codes = np.cumsum(low_bytes + 256 * high_bytes, axis=1) % 65536
    values = np.array(table["low"])[:, None] + np.array(table["step"])[:, None] * codes
    return np.where(codes == MISSING, np.nan, values)


SHAPES = st.tuples(st.integers(1, 4), st.integers(1, 40))
VALUES = st.floats(-1e6, 1e6, allow_subnormal=False) | st.just(np.nan)


@given(arrays.arrays(np.float64, SHAPES, elements=VALUES))
def test_a_value_is_off_by_half_a_step_of_its_curves_range_at_most(rows: np.ndarray) -> None:
    """Otherwise a chart would show what the run did not do."""
    found = unpacked(packed(rows))
    assert (np.isnan(found) == np.isnan(rows)).all()
    for row, own in zip(rows, found, strict=True):
        values = row[~np.isnan(row)]
        if len(values):
            half_a_step = np.ptp(values) / (MISSING - 1) / 2
            # Rounding of the sums themselves: a few units in the last place of the largest value.
            room = half_a_step + 4 * np.spacing(np.abs(values).max())
            assert np.abs(own[~np.isnan(own)] - values).max() <= room


def test_whole_numbers_stay_whole() -> None:
    """Otherwise a queue would hold 3.0004 packets."""
    rows = np.array([[0, 3, 200, 1], [7, 7, 7, 7], [65_000, 2, 1, 0]], float)
    assert (unpacked(packed(rows)) == rows).all()


def test_a_table_without_a_value_can_be_packed() -> None:
    """Otherwise a run that nobody reported in would have no page."""
    assert np.isnan(unpacked(packed(np.full((2, 3), np.nan)))).all()
    assert packed(np.empty((0, 5)))["rows"] == 0


@pytest.mark.parametrize("count", [100, 101, 997])
def test_every_extreme_of_a_long_curve_stays(count: int) -> None:
    """Otherwise a spike of one sample would be missing from the chart of a long run."""
    noise = np.random.default_rng(3).normal(size=(3, count))
    noise[1, 10:40] = np.nan
    time_s = np.arange(count) / 60
    at, kept = thinned(time_s, noise, 20)
    assert len(at) <= 20
    assert (np.diff(at) >= 0).all()
    assert (np.nanmax(kept, axis=1) == np.nanmax(noise, axis=1)).all()
    assert (np.nanmin(kept, axis=1) == np.nanmin(noise, axis=1)).all()


def test_a_short_curve_is_left_as_it_is() -> None:
    """Otherwise a run of usual length would lose samples for nothing."""
    time_s, rows = np.arange(5.0), np.arange(10.0).reshape(2, 5)
    at, kept = thinned(time_s, rows, 5)
    assert at is time_s
    assert kept is rows

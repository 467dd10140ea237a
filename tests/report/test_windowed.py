"""The network's series, read in parts, say what the whole tables say."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tieline.report.windowed import Windowed


@pytest.fixture
def links(tmp_path: Path) -> Path:
    """Return a table of three windows in row groups that cut through them."""
    rows = [
        (0.1, "b", "a", 1.0),
        (0.1, "a", "b", 2.0),
        (0.2, "a", "b", np.nan),
        (0.3, "a", "c", 3.0),
        (0.3, "b", "a", 4.0),
    ]
    path = tmp_path / "links.parquet"
    table = pd.DataFrame(rows, columns=["t_s", "from", "to", "load"])
    table.to_parquet(path, row_group_size=2)
    return path


def test_rows_of_any_row_group_come_to_their_place(links: Path) -> None:
    """Otherwise a curve would show another link, or another moment."""
    series = Windowed(links, "from", "to")
    assert series.keys == [("b", "a"), ("a", "b"), ("a", "c")]
    assert series.windows.tolist() == [0.1, 0.2, 0.3]
    expected = [[1, 0, 4], [2, np.nan, 0], [0, 0, 3]]
    np.testing.assert_array_equal(series.matrix("load", 0.0), expected)
    wider = series.matrix("load", 0.0, np.array([0.1, 0.15, 0.2, 0.3]), only=[2, 0])
    np.testing.assert_array_equal(wider, [[0, 0, 0, 3], [1, 0, 0, 4]])


def test_totals_are_those_of_all_windows(links: Path) -> None:
    """Otherwise the links shown would not be the busiest."""
    totals = Windowed(links, "from", "to").totals("load")
    np.testing.assert_array_equal(totals, [5, np.nan, 3])


def test_a_table_that_was_not_written_has_nothing() -> None:
    """Otherwise a run without series would have no page."""
    series = Windowed(None, "unit")
    assert series.keys == []
    assert series.windows.size == 0
    assert series.matrix("load").shape == (0, 0)

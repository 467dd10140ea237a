"""Figures of the network's series show what the tables hold."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from network.test_series import recorded
from tieline.errors import InputError
from tieline.report.network_figures import (
    busiest_links,
    controller_ages,
    controller_delays,
    draw,
    has_series,
)
from tieline.report.windowed import Windowed


def test_a_run_with_series_gets_its_figures(tmp_path: Path) -> None:
    """Otherwise nobody could see when a controller's data came late."""
    recorded(tmp_path / "r", 1)
    assert has_series(tmp_path / "r")
    names = [path.name for path in draw(tmp_path / "r")]
    assert names == ["controller_delay.png", "controller_age.png", "busiest_links.png"]
    assert all((tmp_path / "r" / "plots" / name).stat().st_size > 10_000 for name in names)
    assert all((tmp_path / "r" / "plots" / name).with_suffix(".svg").is_file() for name in names)


def test_drawing_imports_neither_pandas_nor_what_arrow_computes(tmp_path: Path) -> None:
    """Otherwise the end of every run would wait as long for them as for two figures."""
    recorded(tmp_path / "r", 1)
    script = (
        "import sys; from pathlib import Path; import tieline.experiment.report, tieline.report;"
        "from tieline.report.windowed import Windowed;"
        "Windowed(Path(sys.argv[1]) / 'link_series.parquet', 'from', 'to').totals('utilisation');"
        "print({'pandas', 'pyarrow.compute'} & set(sys.modules))"
    )
    told = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "r"], check=True, capture_output=True, text=True
    )
    assert told.stdout == "set()\n"


def test_a_run_without_series_is_refused(tmp_path: Path) -> None:
    """Otherwise an empty figure would pass for a quiet network."""
    recorded(tmp_path / "r", 1, window_ns=None)
    assert not has_series(tmp_path / "r")
    with pytest.raises(InputError, match=r"controller_series\.parquet is missing"):
        draw(tmp_path / "r")


def windowed(folder: Path, table: pd.DataFrame, *keys: str) -> Windowed:
    """Return a table as the figures read it."""
    path = folder / f"{len(list(folder.iterdir()))}.parquet"
    table.to_parquet(path)
    return Windowed(path, *keys)


def series_of(units: dict[str, float]) -> pd.DataFrame:
    """Return a series of controllers of constant delay and age, s."""
    names = ("delay_mean_s", "delay_p50_s", "delay_p95_s", "age_mean_s", "age_max_s")
    rows = [
        {"t_s": t_s, "unit": unit} | dict.fromkeys(names, value)
        for t_s in (0.1, 0.2)
        for unit, value in units.items()
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize("figure_of", [controller_delays, controller_ages])
def test_slowest_middle_and_fastest_are_drawn(figure_of, tmp_path: Path) -> None:
    """Otherwise the controller in trouble could be the one that is not shown."""
    delays = {"A": 0.2, "B": 0.5, "C": 0.3, "D": 0.1, "E": 0.4, "F": np.nan}
    figure = figure_of(windowed(tmp_path, series_of(delays), "unit"))
    assert [axes.get_title() for axes in figure.axes] == ["B", "C", "D"]
    assert figure.axes[0].get_yscale() == "linear"
    wide = figure_of(windowed(tmp_path, series_of({"A": 0.1, "B": 2.0}), "unit"))
    assert [axes.get_title() for axes in wide.axes] == ["B", "A"]
    assert wide.axes[0].get_yscale() == "log"


def test_a_window_without_a_row_is_drawn_as_an_idle_link(tmp_path: Path) -> None:
    """Otherwise a line would run straight across a silence."""
    row = {"from": "a", "to": "b", "utilisation": 0.5, "max_queue": 3, "dropped_loss": 1}
    other = row | {"from": "b", "to": "a", "utilisation": 0.1}
    rows = [row | {"t_s": 0.1}, other | {"t_s": 0.2}, row | {"t_s": 0.3}]
    table = pd.DataFrame(rows).assign(dropped_queue=2, dropped_down=0)
    figure = busiest_links(windowed(tmp_path, table, "from", "to"))
    load, queue, drops = (axes.lines[0].get_ydata().tolist() for axes in figure.axes)
    assert (load, queue, drops) == ([50.0, 0.0, 50.0], [3, 0, 3], [3, 3, 6])
    assert figure.legends[0].get_texts()[0].get_text() == "a to b"

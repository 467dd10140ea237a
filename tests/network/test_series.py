"""The series of links and controllers: exact windows, whatever the federates' cadence."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from network.builders import busy_ring, chain, overhead_for
from tieline.network.engine import ARRIVAL, NO_DROPS, Outcome
from tieline.network.packet import PacketEngine
from tieline.network.recorder import Recorder
from tieline.tables import read_table, units_of
from tieline.units import tick_ns

FRAMES, RATE = 90, 60
TABLES = ("flows", "links", "delays", "ages", "packets", "link_series", "controller_series")


def recorded(
    folder: Path, meetings: int, window_ns: int | None = 100_000_000, frames: int = FRAMES
) -> dict[str, pd.DataFrame]:
    """Return the tables of a run on the busy ring whose federates meet every few intervals."""
    folder.mkdir()
    spec = busy_ring()
    engine = PacketEngine(spec, seed=4)
    recorder = Recorder(folder, spec, engine, RATE, window_ns, record_packets=True)
    sources = np.arange(len(spec.sources))
    for k in range(frames):
        engine.send(tick_ns(k, RATE), sources, k)
        recorder.add_sent(sources, k)
    for k in [*range(meetings, frames, meetings), frames]:
        for stop_ns in recorder.stops(tick_ns(k, RATE)):
            recorder.add(engine.run_until(stop_ns), stop_ns)
    recorder.write()
    return {path.stem: read_table(path) for path in folder.glob("*.parquet")}


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> dict[str, pd.DataFrame]:
    return recorded(tmp_path_factory.mktemp("series") / "r", 1)


@pytest.mark.parametrize("window_ns", [100_000_000, 33_000_000])
def test_any_cadence_gives_the_same_tables(tmp_path: Path, window_ns: int) -> None:
    """Otherwise a delay over time would depend on how often the federates meet.

    33 ms is no multiple of the reporting interval, so some windows end between two meetings.
    """
    often, seldom = (recorded(tmp_path / str(n), n, window_ns) for n in (1, 7))
    assert set(often) == set(TABLES)
    for name, table in often.items():
        pd.testing.assert_frame_equal(table, seldom[name], check_exact=True)


def test_windows_of_links_add_up_to_the_whole_run(tables: dict[str, pd.DataFrame]) -> None:
    """Otherwise load would be missing from the pictures, or be drawn twice."""
    series, links = tables["link_series"], tables["links"].set_index(["from", "to"])
    sums = series.groupby(["from", "to"]).sum()
    for name in ("packets", "bytes", "dropped_queue", "dropped_loss"):
        assert sums[name].reindex(links.index, fill_value=0).tolist() == links[name].tolist()
    assert links["dropped_queue"].sum() > 0
    assert links["dropped_loss"].sum() > 0
    most = series.groupby(["from", "to"])["max_queue"].max().reindex(links.index, fill_value=0)
    assert most.tolist() == links["max_queue"].tolist()
    assert (series["queue"] <= series["max_queue"]).all()
    # All 15 windows of 0.1 s are whole, so their mean is the utilisation of 1.5 s.
    means = (sums["utilisation"] / 15).reindex(links.index, fill_value=0.0)
    assert means.tolist() == pytest.approx(links["utilisation"].tolist(), abs=1e-9)
    assert series["utilisation"].between(0, 1).all()


def test_reading_the_counters_does_not_change_the_greatest_queue(tmp_path: Path) -> None:
    """Otherwise links.parquet would depend on whether the series is written."""
    with_series = recorded(tmp_path / "with", 1)
    without = recorded(tmp_path / "without", 1, window_ns=None)
    assert set(without) == set(TABLES) - {"link_series", "controller_series"}
    for name, table in without.items():
        pd.testing.assert_frame_equal(table, with_series[name], check_exact=True)


def test_the_queue_of_the_series_is_that_of_its_instant() -> None:
    """Otherwise a queue that has emptied would be drawn as if it still stood.

    Frames of 42 wire bytes each on 1 Mbit/s take 568 us; after 1 ms one has left, one is in
    transmission and the last of three waits.
    """
    spec = chain([(1_000_000, 0)], overhead_bytes=overhead_for(71))
    engine = PacketEngine(spec, seed=1)
    for sequence in range(3):
        engine.send(0, np.array([0]), sequence)
    seen = []
    for until_ns in (0, 1_000_000, 1_200_000, 2_000_000):
        engine.run_until(until_ns)
        [forward, _] = engine.link_counters()
        seen.append((int(forward["queue"]), int(forward["max_queue"]), int(forward["busy_ns"])))
    assert seen == [(2, 2, 0), (1, 2, 1_000_000), (0, 1, 1_200_000), (0, 0, 1_704_000)]
    assert engine.links()[0].max_queue == 2


def test_windows_of_controllers_match_the_packets(tables: dict[str, pd.DataFrame]) -> None:
    """Otherwise a controller's delay over time would not be that of its packets."""
    packets, series = tables["packets"], tables["controller_series"]
    flows = tables["flows"].set_index("flow")
    packets["controller"] = flows["destination"].loc[packets["flow"]].to_numpy()
    # Windows are open at the left and closed at the right.
    packets["t_s"] = np.ceil(packets["ended_ns"] / 1e8).astype(int) / 10
    packets["delay_s"] = (packets["ended_ns"] - packets["measured_ns"]) / 1e9
    is_delivered = packets["outcome"] == 0
    for row in series.itertuples():
        own = packets[
            (packets["controller"] == row.controller) & np.isclose(packets["t_s"], row.t_s)
        ]
        delays_s = np.sort(own["delay_s"][is_delivered[own.index]])
        assert (row.delivered, row.lost) == (len(delays_s), len(own) - len(delays_s))
        if not len(delays_s):
            assert np.isnan(row.delay_mean_s)
            continue
        assert row.delay_mean_s == pytest.approx(delays_s.mean(), rel=1e-12)
        assert row.delay_max_s == delays_s[-1]
        assert row.delay_p50_s == delays_s[int(np.ceil(0.5 * len(delays_s))) - 1]
        assert row.delay_p95_s == delays_s[int(np.ceil(0.95 * len(delays_s))) - 1]
    assert series["lost"].sum() == (~is_delivered).sum() > 0


def test_ages_of_the_series_match_the_packets(tables: dict[str, pd.DataFrame]) -> None:
    """Otherwise the age that is drawn would not be that of the data a controller held."""
    packets, flows = tables["packets"], tables["flows"]
    delivered = packets[packets["outcome"] == 0]
    for row in tables["controller_series"].itertuples():
        own = flows["flow"][flows["destination"] == row.controller]
        ages_s = []
        for flow in own:
            held = delivered[(delivered["flow"] == flow) & (delivered["ended_ns"] <= row.t_s * 1e9)]
            if len(held):
                ages_s.append(row.t_s - held["measured_ns"].max() / 1e9)
        assert row.age_mean_s == pytest.approx(np.mean(ages_s), abs=1e-12)
        assert row.age_max_s == pytest.approx(max(ages_s), abs=1e-12)


def test_ages_of_controllers_sum_up_their_flows(tables: dict[str, pd.DataFrame]) -> None:
    """Otherwise the two tables would contradict one another."""
    by_controller = tables["flows"].groupby("destination")
    ages = tables["ages"].set_index("controller")
    assert ages["pmus"].tolist() == [2, 2, 2]
    for name, figure in (("age_mean_s", "mean"), ("age_peak_s", "mean"), ("age_max_s", "max")):
        expected = by_controller[name].agg(figure)
        assert ages[name].tolist() == pytest.approx(expected.tolist(), rel=1e-12)


def test_a_last_window_may_be_short(tmp_path: Path) -> None:
    """Otherwise the end of a run would be missing from its series, or be taken for a whole window.

    1.1 s in windows of 0.25 s leave one of 0.1 s.
    """
    tables = recorded(tmp_path / "r", 1, 250_000_000, frames=66)
    ends_s = sorted(set(tables["controller_series"]["t_s"]))
    assert ends_s == [0.25, 0.5, 0.75, 1.0, 1.1]
    last = tables["link_series"][tables["link_series"]["t_s"] == 1.1]
    assert last["utilisation"].max() > 0.5


def test_a_window_holds_its_own_arrivals_only(tmp_path: Path) -> None:
    """Otherwise the memory would grow with the run."""
    spec = busy_ring()
    engine = PacketEngine(spec, seed=4)
    recorder = Recorder(tmp_path, spec, engine, RATE, 100_000_000, record_packets=False)
    rows = np.zeros(1, ARRIVAL)
    for k in range(1, 600):
        rows["sequence"], rows["arrival_ns"] = k - 1, tick_ns(k, RATE)
        recorder.add_sent(np.array([0]), k - 1)
        recorder.add(Outcome(rows.copy(), NO_DROPS), tick_ns(k, RATE))
        assert len(recorder._controllers._keys) <= 6


def test_columns_say_their_unit(tmp_path: Path) -> None:
    """Otherwise a reader would have to guess seconds from milliseconds."""
    recorded(tmp_path / "r", 1, frames=6)
    for name in TABLES:
        units = units_of(tmp_path / "r" / f"{name}.parquet")
        assert all(description for _, description in units.values())
        assert all(unit == "s" for column, (unit, _) in units.items() if column.endswith("_s"))

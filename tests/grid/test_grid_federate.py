"""The grid as the federation sees it: bundles in, frames out, tables at the end."""

from pathlib import Path

import numpy as np
import pytest

from grid.federate_runs import (
    CONTROLLERS,
    F_HZ,
    PSS,
    RATE_HZ,
    SENSORS,
    STEPS,
    TRIP,
    WBAR,
    column,
    delivered,
    frames_of,
    opened,
    run_through,
)
from tieline.c37118.batch import decode_frames, read_frames
from tieline.cosim.interfaces import FrameBundle
from tieline.errors import CosimError, NumericalError, TimeContractBroken
from tieline.grid.case import Case
from tieline.grid.federate import open_participant
from tieline.grid.powerflow import PowerFlow
from tieline.resources import case_folder
from tieline.tables import metadata_of, read_table, units_of
from tieline.units import tick_ns


def test_the_frames_say_what_the_pmus_measured(miniwecc: Case, tmp_path: Path) -> None:
    """What leaves the grid is what a controller could have measured itself, and nothing else."""
    grid = opened(miniwecc, tmp_path, {"events": [TRIP]})
    bundles = [FrameBundle.from_bytes(grid.start()[0])]
    bundles += [FrameBundle.from_bytes(grid.advance(k, delivered(k))) for k in range(6)]
    grid.finish()
    table = read_table(tmp_path / "grid.parquet")
    assert len(table) == len(bundles)
    for k, bundle in enumerate(bundles):
        frames, verdicts = decode_frames(bundle.payloads)
        assert bundle.measured_ns == tick_ns(k, RATE_HZ)
        assert not verdicts.any()
        assert frames["IDCODE"].tolist() == list(range(1, SENSORS + 1))
        # Time tags are whole microseconds.
        tags_ns = read_frames(bundle.payloads).tags_ns
        np.testing.assert_allclose(tags_ns, bundle.measured_ns, rtol=0, atol=500)
        for i, bus in enumerate(miniwecc.base.sensors):
            f_hz, v_pu = table[f"f_hz.B{bus}"][k], table[f"v_pu.B{bus}"][k]
            volts = v_pu * miniwecc.buses.base_kV[miniwecc.bus_index(bus)] * 1e3 / np.sqrt(3)
            # Single precision: 24 bits.
            assert frames["FREQ"][i] == pytest.approx(f_hz, rel=2**-23)
            assert np.hypot(*frames["PHASOR"][i]) == pytest.approx(volts, rel=2**-22)
    assert np.ptp(frames["FREQ"]) > 1e-3


def test_a_stride_at_once_is_the_same_as_interval_by_interval(
    miniwecc: Case, tmp_path: Path
) -> None:
    """Otherwise a result would depend on how often the federates meet."""
    event = {"at": 0.025, "trip_generator": "G26"}
    coming = {k: (tick_ns(k, RATE_HZ) + 7_000_000, k, frames_of(F_HZ, 0)) for k in range(1, 6)}
    found = []
    for lead, stride in ((0, 1), (5, 3)):
        folder = tmp_path / str(lead)
        folder.mkdir()
        grid = opened(miniwecc, folder, {"events": [event]}, lead=lead)
        frames = grid.start()
        for first in range(0, 6, stride):
            last = first + stride
            arrivals = [coming[k] for k in range(first, last) if k in coming]
            until_ns = tick_ns(last, RATE_HZ)
            frames.append(grid.advance(first, delivered(first, *arrivals, until_ns=until_ns)))
        grid.finish()
        tables = [read_table(path) for path in sorted(folder.glob("*.parquet"))]
        found.append((b"".join(frames), tables))
    assert found[0][0] == found[1][0]
    assert len(FrameBundle.several_from_bytes(found[0][0])) == 7
    for one, other in zip(found[0][1], found[1][1], strict=True):
        assert one.equals(other)


@pytest.mark.parametrize(
    ("arrival_ns", "tick"),
    [
        (0, 0),
        (1, 1),
        (tick_ns(1, STEPS) - 1, 1),
        (tick_ns(1, STEPS), 1),
        (tick_ns(1, STEPS) + 1, 2),
        (tick_ns(3, STEPS) + 1, 4),
        (tick_ns(4, STEPS), 4),
    ],
)
def test_a_delivery_acts_from_the_first_step_at_or_after_its_arrival(
    miniwecc: Case, tmp_path: Path, arrival_ns: int, tick: int
) -> None:
    """Until then the old belief stands; a step early would be a measurement from the future."""
    grid = opened(miniwecc, tmp_path, {"records_per_second": STEPS})
    grid.start()
    grid.advance(0, delivered(0, (arrival_ns, 3, frames_of(F_HZ, 0))))
    run_through(grid, 1)
    grid.finish()
    believed = column(tmp_path, f"wbar_pu.{miniwecc.units[3]}")
    assert (believed[:tick] == 1.0).all()
    assert (believed[tick:] == WBAR).all()
    assert (column(tmp_path, f"wbar_pu.{miniwecc.units[4]}") == 1.0).all()
    # nu = (beta1 - beta2) (omega - wbar) < 0 acts at once.
    v_s = column(tmp_path, f"vs_pu.{miniwecc.units[3]}")
    assert np.abs(v_s[:tick]).max(initial=0.0) < 1e-9
    assert v_s[tick] < -1e-3


@pytest.mark.parametrize(
    ("k", "arrival_ns"),
    [
        (0, tick_ns(1, RATE_HZ) + 1),
        (1, tick_ns(1, RATE_HZ) - 1),
        (1, 0),
        (1, tick_ns(2, RATE_HZ) + 1),
        (0, -1),
    ],
)
def test_a_delivery_outside_its_interval_breaks_the_contract(
    miniwecc: Case, tmp_path: Path, k: int, arrival_ns: int
) -> None:
    """Applied late, or kept for later, it would change the result without a word."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    run_through(grid, 0, k)
    with pytest.raises(TimeContractBroken, match=f"{arrival_ns} ns came for the interval from"):
        grid.advance(k, delivered(k, (arrival_ns, 0, frames_of(F_HZ, 0))))
    grid.abort("test")


def test_a_delivery_on_the_instant_of_a_meeting_may_come_in_either_bundle(
    miniwecc: Case, tmp_path: Path
) -> None:
    """A frame without any delay is measured at t_k and comes in the bundle from t_k on."""
    for k, folder in enumerate((tmp_path / "before", tmp_path / "after")):
        folder.mkdir()
        grid = opened(miniwecc, folder, {"records_per_second": STEPS})
        grid.start()
        run_through(grid, 0, k)
        grid.advance(k, delivered(k, (tick_ns(1, RATE_HZ), 0, frames_of(F_HZ, 0))))
        run_through(grid, k + 1)
        grid.finish()
        assert np.argmax(column(folder, "wbar_pu.G1") == WBAR) == STEPS // RATE_HZ


def test_deliveries_of_one_step_are_taken_in_their_order(miniwecc: Case, tmp_path: Path) -> None:
    """The newest by time tag counts, also when both arrive between the same two steps."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    run_through(grid, 0, 1)
    t1_ns = tick_ns(1, RATE_HZ)
    early, late = (t1_ns + 1, 0, frames_of(F_HZ, t1_ns)), (t1_ns + 2, 0, frames_of(59.0, 0))
    grid.advance(1, delivered(1, early, late))
    run_through(grid, 2)
    grid.finish()
    assert column(tmp_path, "wbar_pu.G1")[2] == WBAR


def test_a_late_frame_does_not_overwrite_a_newer_one(miniwecc: Case, tmp_path: Path) -> None:
    """Networks reorder; a controller that took the older frame would step back in time."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    run_through(grid, 0, 2)
    newer, older = frames_of(F_HZ, tick_ns(1, RATE_HZ)), frames_of(59.0, 0)
    grid.advance(2, delivered(2, (tick_ns(2, RATE_HZ) + 5, 0, newer)))
    grid.advance(3, delivered(3, (tick_ns(3, RATE_HZ) + 5, 0, older)))
    run_through(grid, 4)
    grid.finish()
    assert (column(tmp_path, "wbar_pu.G1")[3:] == WBAR).all()
    counts = read_table(tmp_path / "controllers.parquet")
    assert counts["late"].tolist() == [SENSORS] + [0] * (CONTROLLERS - 1)
    assert counts["accepted"].tolist() == [SENSORS] + [0] * (CONTROLLERS - 1)


def test_a_frame_with_a_bad_crc_is_refused_and_counted(miniwecc: Case, tmp_path: Path) -> None:
    """A flipped bit must not become a frequency."""
    frames = frames_of(F_HZ, 0)
    frames[7, 26] ^= 0x40
    grid = opened(miniwecc, tmp_path)
    grid.start()
    grid.advance(0, delivered(0, (10, 5, frames)))
    run_through(grid, 1)
    grid.finish()
    believed = column(tmp_path, f"wbar_pu.{miniwecc.units[5]}")
    # Twenty-nine of thirty sensors show half a hertz more.
    assert believed[1] == pytest.approx(1.0 + 29 / 30 * 0.5 / 60.0, abs=1e-15)
    counts = read_table(tmp_path / "controllers.parquet")
    assert counts["unit"].tolist() == list(miniwecc.units)
    assert counts["controller"].tolist() == list(range(CONTROLLERS))
    assert counts["bad_crc"].tolist() == [0] * 5 + [1] + [0] * 28
    assert counts["accepted"][5] == SENSORS - 1
    descriptions = units_of(tmp_path / "controllers.parquet")
    assert descriptions["bad_crc"] == ("", "frames: bad crc")


def test_a_message_that_is_no_bundle_is_refused(miniwecc: Case, tmp_path: Path) -> None:
    """Bytes cut short on their way must not be read as fewer deliveries."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    whole = delivered(0, (10, 0, frames_of(F_HZ, 0)))
    for data in (b"", whole[:-1], whole + b"\0"):
        with pytest.raises(CosimError):
            grid.advance(0, data)
    grid.abort("test")


@pytest.mark.parametrize(
    ("records", "instants"),
    [(60, [k / 60 for k in range(7)]), (20, [0, 0.05, 0.1]), (240, [k / 240 for k in range(25)])],
)
def test_the_table_has_a_row_a_recorded_instant_and_the_last(
    miniwecc: Case, tmp_path: Path, records: int, instants: list[float]
) -> None:
    """Finer or coarser than the frames, the recording must not touch what is recorded."""
    grid = opened(miniwecc, tmp_path, {"records_per_second": records, "events": [TRIP]})
    grid.start()
    run_through(grid)
    grid.finish()
    assert column(tmp_path, "t_s").tolist() == instants
    (tmp_path / "other").mkdir()
    plain = opened(miniwecc, tmp_path / "other", {"events": [TRIP]})
    plain.start()
    run_through(plain)
    plain.finish()
    assert column(tmp_path, "speed_pu.G23")[-1] == column(tmp_path / "other", "speed_pu.G23")[-1]


def test_a_last_instant_off_the_recording_grid_is_recorded_too(
    miniwecc: Case, tmp_path: Path
) -> None:
    """The end of a run is what its settling value is read from."""
    grid = opened(miniwecc, tmp_path, {"records_per_second": 20})
    grid.start()
    run_through(grid, 0, 4)
    grid.finish()
    assert column(tmp_path, "t_s").tolist() == [0.0, 0.05, 4 / 60]


def test_the_table_has_the_documented_columns_with_their_units(
    miniwecc: Case, tmp_path: Path
) -> None:
    """A table that needs its program to be understood is no result."""
    grid = opened(miniwecc, tmp_path, {"pss": {**PSS, "units": "all"}})
    grid.start()
    grid.finish()
    columns = units_of(tmp_path / "grid.parquet")
    expected = ["t_s", "coi_pu"]
    for quantity in ("speed_pu", "vt_pu", "Efd_pu", "vs_pu", "Pe_pu", "Pm_pu", "wbar_pu", "age_s"):
        expected += [f"{quantity}.{unit}" for unit in miniwecc.units]
    expected += [f"f_hz.B{bus}" for bus in miniwecc.base.sensors]
    expected += [f"v_pu.B{bus}" for bus in miniwecc.buses.number]
    assert set(columns) == set(expected)
    units = {name.split(".")[0]: unit for name, (unit, _) in columns.items()}
    assert units["t_s"] == units["age_s"] == "s"
    assert units["f_hz"] == "Hz"
    assert units["speed_pu"] == units["v_pu"] == units["wbar_pu"] == "pu"
    assert units["Pe_pu"] == "pu on the system base"
    assert units["Pm_pu"] == "pu on the machine base"
    assert all(text for _, text in columns.values())
    assert "tripped_units" in metadata_of(tmp_path / "grid.parquet")


def test_the_first_row_is_the_power_flow(miniwecc: Case, flow: PowerFlow, tmp_path: Path) -> None:
    """Powers on the wrong base would still look like powers."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    grid.finish()
    row = read_table(tmp_path / "grid.parquet").iloc[0]
    for at, unit in enumerate(miniwecc.units):
        bus, rating = miniwecc.unit_bus[at], miniwecc.unit_MVA[at] / miniwecc.base.base_MVA
        assert row[f"vt_pu.{unit}"] == pytest.approx(flow.v[bus], abs=1e-10)
        assert row[f"Pe_pu.{unit}"] == pytest.approx(flow.p_gen[bus], abs=1e-8)
        # No unit of the miniWECC has an armature resistance.
        assert row[f"Pm_pu.{unit}"] * rating == pytest.approx(flow.p_gen[bus], abs=1e-8)


def test_an_end_before_time_leaves_what_was_recorded_readable(
    miniwecc: Case, tmp_path: Path
) -> None:
    """The minutes before a failure are what its cause is looked for in."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    run_through(grid, 0, 2)
    grid.abort("the network died")
    assert column(tmp_path, "t_s").tolist() == [0.0, 1 / 60]
    assert not (tmp_path / "controllers.parquet").exists()


def test_a_grid_that_fails_says_so_and_keeps_its_rows(miniwecc: Case, tmp_path: Path) -> None:
    """A number that is none must end the run, not its table."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    run_through(grid, 0, 2)
    grid._grid._x[0] = np.nan
    grid._grid._is_current = False
    with pytest.raises(NumericalError, match=r"delta.G1 is not finite at t = 0\.0333 s"):
        grid.advance(2, delivered(2))
    grid.abort("it failed")
    assert len(column(tmp_path, "t_s")) >= 2


def test_the_age_is_counted_from_the_measurement_or_else_from_the_start(
    miniwecc: Case, tmp_path: Path
) -> None:
    """Age of information is what a delayed control suffers from; it grows between deliveries."""
    grid = opened(miniwecc, tmp_path)
    grid.start()
    run_through(grid, 0, 2)
    frames = frames_of(F_HZ, tick_ns(1, RATE_HZ))
    grid.advance(
        2, delivered(2, (tick_ns(2, RATE_HZ), 0, frames), (tick_ns(2, RATE_HZ), 1, frames[:15]))
    )
    run_through(grid, 3)
    grid.finish()
    since_start = np.arange(7) / RATE_HZ
    heard = np.where(np.arange(7) >= 2, 1 / RATE_HZ, 0.0)
    # Time tags are whole microseconds.
    for unit, share in (("G1", 1.0), ("G2", 0.5), ("G3", 0.0)):
        expected = since_start - share * heard
        np.testing.assert_allclose(column(tmp_path, f"age_s.{unit}"), expected, rtol=0, atol=1e-6)


def test_units_without_a_controller_believe_in_synchronous_speed(
    miniwecc: Case, tmp_path: Path
) -> None:
    """A unit outside the scheme must not hear what is meant for another."""
    run = {
        "clock": {"rate_hz": RATE_HZ, "intervals": 6},
        "case": str(case_folder("miniwecc")),
        "grid": {"duration": 0.1, "pss": {**PSS, "units": ["G2", "G9"]}},
        "wams": {"sensors": [61, 2], "weights": [3.0, 1.0]},
        "network": {"delay": None},
        "federation": {},
        "destinations": [
            {"name": "ctl00", "unit": "G2", "bus": 3},
            {"name": "ctl01", "unit": "G9", "bus": 0},
        ],
    }
    grid = open_participant(run, tmp_path)
    assert len(FrameBundle.from_bytes(grid.start()[0]).payloads) == 2
    # Source 0 at 60.5 Hz with weight 3, source 1 at 60 Hz with weight 1.
    frames = np.concatenate([frames_of(F_HZ, 0)[:1], frames_of(60.0, 0)[1:2]])
    grid.advance(0, delivered(0, (10, 1, frames)))
    run_through(grid, 1)
    grid.finish()
    assert column(tmp_path, "wbar_pu.G9")[1] == 1.0 + 0.75 * 0.5 / 60.0
    assert (column(tmp_path, "wbar_pu.G2") == 1.0).all()
    assert (column(tmp_path, "wbar_pu.G1") == 1.0).all()
    names = read_table(tmp_path / "grid.parquet").columns
    assert [name for name in names if name.startswith("age_s")] == ["age_s.G2", "age_s.G9"]
    assert [name for name in names if name.startswith("f_hz")] == ["f_hz.B61", "f_hz.B2"]

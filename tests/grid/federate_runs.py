"""The miniWECC's grid federate with handmade deliveries, in place of a network."""

from pathlib import Path
from typing import Any

import numpy as np

from tieline.c37118.batch import encode_frames, read_frames
from tieline.cosim.interfaces import DELIVERY, DeliveryBundle
from tieline.grid.case import Case
from tieline.grid.federate import GridFederate, open_participant
from tieline.resources import case_folder
from tieline.tables import read_table
from tieline.units import NS_PER_S, tick_ns

RATE_HZ, STEPS, SENSORS, CONTROLLERS = 60, 240, 30, 34
TRIP = {"at": 0.0, "trip_generator": "G26"}
PSS = {"gain": 9.0, "beta1": 1.0, "beta2": 0.5}
# Exact in the frames' single precision, so that beliefs can be asserted to the last bit.
F_HZ, WBAR = 60.5, 1.0 + 0.5 / 60.0


def opened(
    case: Case,
    folder: Path,
    grid: dict[str, Any] | None = None,
    wams: dict[str, Any] | None = None,
    delay: float | None = None,
    lead: int = 0,
) -> GridFederate:
    """Return the grid of a run of the miniWECC with 60 meetings a second, fewer with a lead."""
    destinations = [{"name": unit, "unit": unit, "bus": 0} for unit in case.units]
    run = {
        "clock": {"rate_hz": RATE_HZ, "intervals": 6, "lead": lead},
        "case": str(case_folder("miniwecc")),
        "grid": {"duration": 0.1, "pss": PSS, **(grid or {})},
        "wams": wams or {},
        "network": {"delay": delay},
        "federation": {},
        "destinations": destinations,
    }
    return open_participant(run, folder)


def frames_of(f_hz: float, measured_ns: int) -> np.ndarray:
    """Return a frame of each sensor, all showing one frequency."""
    numbers = np.arange(1, SENSORS + 1)
    ones = np.ones(SENSORS)
    return encode_frames(numbers, measured_ns, ones + 0j, f_hz * ones, 0.0 * ones)


def delivered(k: int, *arrivals: tuple[int, int, np.ndarray], until_ns: int | None = None) -> bytes:
    """Return interval k's bundle: each (arrival_ns, controller, frames) brings all its frames.

    The number of a frame is that of the instant that its time tag says.
    """
    rows, records = [np.zeros((0, 34), np.uint8)], []
    for arrival_ns, controller, frames in arrivals:
        sequences = np.rint(read_frames(frames).tags_ns * (RATE_HZ / NS_PER_S)).astype(int)
        for source, sequence in enumerate(sequences):
            row = sum(map(len, rows)) + source
            records.append((arrival_ns, source, controller, sequence, row))
        rows.append(frames)
    table = np.array(sorted(records), DELIVERY)
    until = tick_ns(k + 1, RATE_HZ) if until_ns is None else until_ns
    return DeliveryBundle(until, table, np.concatenate(rows)).to_bytes()


def run_through(grid: GridFederate, first: int = 0, last: int = 6) -> None:
    """Take the grid through intervals without deliveries."""
    for k in range(first, last):
        grid.advance(k, delivered(k))


def column(folder: Path, name: str) -> np.ndarray:
    """Return a column of grid.parquet."""
    return read_table(folder / "grid.parquet")[name].to_numpy()

"""The grid as a participant of the federation: takes deliveries, integrates, sends frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.cosim.interfaces import GRID, Clock, DeliveryBundle, FrameBundle
from tieline.errors import InputError, TimeContractBroken
from tieline.grid.case import Case, load_case
from tieline.grid.check import sensor_buses
from tieline.grid.devices import with_pss
from tieline.grid.events import plan_events
from tieline.grid.plan import HELD, SENSORS, Average
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.recorder import Recorder
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import build_system, rotor_average, sensor_average
from tieline.tables import Column, write_table
from tieline.units import NS_PER_S, seconds_to_ns, tick_ns
from tieline.wams import PmuReporter, WideAreaAverage
from tieline.wams.settings import WamsSettings

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class GridRun:
    """The grid's part of a run file.

    Attributes:
        fitted: (controllers,) row of the unit that each controller belongs to.
        delay_ns: delay of the continuously formed average; None when frames carry it.
    """

    clock: Clock
    case: Case
    settings: GridSettings
    wams: WamsSettings
    fitted: Integers
    delay_ns: int | None

    @classmethod
    def read(cls, run: Mapping[str, Any]) -> "GridRun":
        """Return what a run file says.

        Raises:
            InputError: the case or the settings cannot be used.
        """
        settings = GridSettings.model_validate(run["grid"])
        wams = WamsSettings.model_validate(run["wams"])
        case = with_pss(load_case(Path(run["case"])), settings.pss)
        fitted = [case.units.index(item["unit"]) for item in run["destinations"]]
        is_continuous = wams.reporting == "continuous"
        return cls(
            clock=Clock(**run["clock"]),
            case=case,
            settings=settings,
            wams=wams,
            fitted=np.array(fitted, np.int64),
            delay_ns=seconds_to_ns(run["network"]["delay"] or 0.0) if is_continuous else None,
        )


def open_participant(run: Mapping[str, Any], folder: Path) -> "GridFederate":
    """Return the grid of a run file, at rest; it writes its tables into `folder`."""
    return GridFederate(GridRun.read(run), folder)


class GridFederate:
    """The grid between two meetings of the federation.

    Args:
        run: what it simulates.
        folder: where grid.parquet and controllers.parquet go.
    """

    name = GRID

    def __init__(self, run: GridRun, folder: Path) -> None:
        self._run = run
        self._folder = folder
        case, settings, clock = run.case, run.settings, run.clock
        sensors = sensor_buses(case, run.wams)
        system = build_system(case, solve_power_flow(case), sensors, _average(run, len(sensors)))
        self._grid = Grid(
            system,
            method=settings.method,
            steps_per_second=settings.steps_per_second,
            events=plan_events(case, settings),
        )
        self._per_interval = settings.steps_per_second // clock.rate_hz
        self._per_record = settings.steps_per_second // settings.records_per_second
        idcodes = np.arange(1, len(sensors) + 1)
        f0_hz = float(case.base.frequency_Hz)
        self._reporter = PmuReporter(idcodes, case.buses.base_kV[system.sensor_bus] * 1e3)
        self._belief = WideAreaAverage(
            len(run.fitted), idcodes, _weights(run.wams, len(sensors)), f0_hz
        )
        self._wbar = np.ones(len(case.units))
        is_fitted = np.zeros(len(case.units))
        is_fitted[run.fitted] = 1.0
        self._recorder = Recorder(folder / "grid.parquet", self._grid, sensors, is_fitted)

    def start(self) -> bytes:
        """Return the frames measured at t_0."""
        return self._frames()

    def advance(self, k: int, received: bytes) -> bytes:
        """Integrate [t_k, t_k+1], each delivery at its step boundary; return the frames of t_k+1.

        Raises:
            TimeContractBroken: a delivery lies outside the interval.
            NumericalError: the integration failed.
        """
        bundle = DeliveryBundle.from_bytes(received)
        first, last = k * self._per_interval, (k + 1) * self._per_interval
        ticks = self._boundaries(bundle, first, last)
        readings = self._belief.read(bundle.payloads)
        changes = np.unique(ticks).tolist()
        for tick in sorted({*changes, *self._record_ticks(first, last), first, last}):
            self._grid.advance(tick)
            due = ticks == tick
            if due.any():
                records = bundle.records[due]
                self._belief.apply(readings, records["destination"], records["payload"])
                self._wbar[self._run.fitted] = self._belief.wbar_pu
                self._grid.believe(self._wbar)
            if tick % self._per_record == 0 and tick < last:
                self._record()
        return self._frames()

    def finish(self) -> None:
        """Record the last instant and complete the tables."""
        self._record()
        self._recorder.close()
        counts = self._belief.counts
        columns = [Column("controller", "", "number of the controller", "int64")]
        columns.append(Column("unit", "", "unit that it belongs to", "str"))
        columns += [
            Column(name, "", f"frames: {name.replace('_', ' ')}", "int64") for name in counts
        ]
        units = np.array([self._run.case.units[row] for row in self._run.fitted], dtype=object)
        data = {"controller": np.arange(len(units)), "unit": units, **counts}
        write_table(self._folder / "controllers.parquet", columns, data)

    def abort(self, reason: str) -> None:
        """Close grid.parquet over what was recorded."""
        self._recorder.close()

    def _record_ticks(self, first: int, last: int) -> range:
        start = -(-first // self._per_record) * self._per_record
        return range(start, last, self._per_record)

    def _boundaries(self, bundle: DeliveryBundle, first: int, last: int) -> Integers:
        """Return (deliveries,) the first step boundary at or after each arrival."""
        arrival = bundle.records["arrival_ns"].astype(np.int64)
        ticks = -(-arrival * self._grid.steps_per_second // NS_PER_S)
        if len(ticks) and not (first <= ticks.min() and ticks.max() <= last):
            since = tick_ns(first, self._grid.steps_per_second)
            until = tick_ns(last, self._grid.steps_per_second)
            raise TimeContractBroken(
                f"deliveries at {arrival.min()} to {arrival.max()} ns came for the interval from "
                f"{since} to {until} ns"
            )
        return ticks

    def _frames(self) -> bytes:
        rate = self._grid.steps_per_second
        now_ns = tick_ns(self._grid.tick, rate)
        if self._run.delay_ns is not None:
            return FrameBundle(now_ns, np.zeros((0, 0), np.uint8)).to_bytes()
        reading = self._grid.reading()
        payloads = self._reporter.frames(now_ns, reading.v, reading.f_hz, reading.rocof_hz_s)
        return FrameBundle(now_ns, payloads).to_bytes()

    def _record(self) -> None:
        now_ns = tick_ns(self._grid.tick, self._grid.steps_per_second)
        if self._run.delay_ns is None:
            age_s = self._belief.age_s(now_ns)
        else:
            age_s = np.full(len(self._run.fitted), min(now_ns, self._run.delay_ns) / NS_PER_S)
        self._recorder.record(age_s)


def _weights(wams: WamsSettings, sensors: int) -> list[float]:
    return [1.0] * sensors if wams.weights == "equal" else list(wams.weights)


def _average(run: GridRun, sensors: int) -> Average:
    """Return how wbar is formed inside the grid; held when frames bring it.

    Raises:
        InputError: the delay of a continuous average does not fit the step.
    """
    weights = np.array(_weights(run.wams, sensors))
    if run.delay_ns is None:
        return sensor_average(weights, mode=HELD)
    steps = _delay_steps(run)
    if run.settings.pss.average == "rotors":
        return rotor_average(np.ones(len(run.case.units)), steps)
    return sensor_average(weights, steps, SENSORS)


def _delay_steps(run: GridRun) -> int:
    assert run.delay_ns is not None
    rate = run.settings.steps_per_second
    steps = round(run.delay_ns * rate / NS_PER_S)
    if abs(tick_ns(steps, rate) - run.delay_ns) > 1:
        raise InputError(
            f"network.delay: with continuous reporting it must be a whole number of steps of "
            f"1/{rate} s (got {run.delay_ns / NS_PER_S:g} s; {steps / rate:.9g} s would do)"
        )
    if steps == 1 and run.settings.method == "rk4":
        raise InputError(
            f"network.delay: rk4 needs 0 or at least two steps of 1/{rate} s (got one)"
        )
    return steps

"""The grid as a participant of the federation: takes deliveries, integrates, sends frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.cosim.border import DeliveryBorder
from tieline.cosim.guests import Command, GuestSettings, unit_owners
from tieline.cosim.interfaces import GRID, Clock, DeliveryBundle, FrameBundle
from tieline.errors import CosimError, TimeContractBroken
from tieline.grid.average import continuous_average, sensor_weights
from tieline.grid.case import Case, load_case
from tieline.grid.check import sensor_buses
from tieline.grid.devices import with_pss
from tieline.grid.events import plan_events
from tieline.grid.finite import LARGEST_IN_A_FRAME, check_finite
from tieline.grid.load_mix import with_load_mix
from tieline.grid.models.registry import use_file
from tieline.grid.modulation import Modulation
from tieline.grid.plan import HELD, Average
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.recorder import Recorder
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid, Reading
from tieline.grid.system import build_system, sensor_average
from tieline.tables import Column, write_table
from tieline.units import NS_PER_S, seconds_to_ns, tick_ns
from tieline.wams import PmuReporter, Readings, WideAreaAverage
from tieline.wams.settings import WamsSettings

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class GridRun:
    """The grid's part of a run file.

    Attributes:
        fitted: (controllers,) row of the unit that each controller belongs to.
        delay_ns: delay of the continuously formed average; None when frames carry it.
        owners: the guest that may move a unit's stabiliser signal, by unit.
    """

    clock: Clock
    case: Case
    settings: GridSettings
    wams: WamsSettings
    fitted: Integers
    delay_ns: int | None
    owners: Mapping[str, GuestSettings]

    @classmethod
    def read(cls, run: Mapping[str, Any]) -> "GridRun":
        """Return what a run file says.

        Raises:
            InputError: the case or the settings cannot be used.
        """
        settings = GridSettings.model_validate(run["grid"])
        wams = WamsSettings.model_validate(run["wams"])
        use_file("pss", settings.pss.file)
        case = with_load_mix(load_case(Path(run["case"])), settings.loads)
        case = with_pss(case, settings.pss)
        fitted = [case.units.index(item["unit"]) for item in run["destinations"]]
        is_continuous = wams.reporting == "continuous"
        return cls(
            clock=Clock(**run["clock"]),
            case=case,
            settings=settings,
            wams=wams,
            fitted=np.array(fitted, np.int64),
            delay_ns=seconds_to_ns(run["network"]["delay"] or 0.0) if is_continuous else None,
            owners=unit_owners(run),
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
        of_rotors = settings.pss.average == "rotors"
        weights = sensor_weights(case, sensors, "equal" if of_rotors else run.wams.weights)
        average = _average(run, sensors, weights)
        system = build_system(case, solve_power_flow(case), sensors, average)
        self._grid = Grid(
            system,
            method=settings.method,
            steps_per_second=settings.steps_per_second,
            events=plan_events(case, settings, tuple(sensors)),
        )
        self._per_interval = settings.steps_per_second // clock.rate_hz
        self._per_record = settings.steps_per_second // settings.records_per_second
        idcodes = np.arange(1, len(sensors) + 1)
        f0_hz = float(case.base.frequency_Hz)
        self._sensors = sensors
        self._base_v = case.buses.base_kV[system.sensor_bus] * 1e3
        self._reporter = PmuReporter(idcodes, self._base_v)
        self._border = DeliveryBorder(clock, len(sensors), len(run.fitted))
        self._belief = WideAreaAverage(len(run.fitted), idcodes, weights, f0_hz)
        is_fitted = np.zeros(len(case.units))
        is_fitted[run.fitted] = 1.0
        self._recorder = Recorder(
            folder / "grid.parquet", self._grid, self._per_record, sensors, is_fitted
        )
        self._modulation = Modulation(self._grid, run.owners) if run.owners else None

    def start(self) -> list[bytes]:
        """Return the frames measured at t_0."""
        return [self._frames_at(0)]

    def advance(self, k: int, received: bytes) -> bytes:
        """Integrate a stride from t_k on, each delivery at its step boundary; return its frames.

        Raises:
            TimeContractBroken: as `DeliveryBorder.check`, or a frame's own time tag lies behind
                its arrival.
            NumericalError: the integration failed, or what is to be recorded or sent is not
                finite.
        """
        bundle = DeliveryBundle.from_bytes(received)
        self._border.check(k, bundle)
        first, last = k * self._per_interval, self._run.clock.next_meeting(k) * self._per_interval
        self._expect(bundle, first, last)
        instants = range(first + self._per_interval, last + 1, self._per_interval)
        return b"".join(map(self._frames_at, instants))

    def _expect(self, bundle: DeliveryBundle, first: int, last: int) -> None:
        """Have the grid expect what controllers will believe from tick to tick of a stride."""
        columns = bundle.columns
        # The first step boundary at or after each arrival.
        ticks = -(-columns.arrival_ns * self._grid.steps_per_second // NS_PER_S)
        readings = self._belief.read(bundle.payloads)
        _check_tags(bundle, readings)
        records = self._record_ticks(first, last)
        ends = np.searchsorted(ticks, [*records, last], side="right")
        dues: list[Integers] = []
        means: list[Floats] = []
        for begin, end, tick in zip([0, *ends[:-1]], ends, [*records, None], strict=True):
            some = slice(begin, end)
            due, wbar_pu = self._belief.apply(
                readings, columns.destination[some], columns.payload[some], ticks[some]
            )
            dues.append(due)
            means.append(wbar_pu)
            if tick is not None:
                self._note_age(tick)
        told = np.ones((sum(map(len, dues)), len(self._run.case.units)))
        told[:, self._run.fitted] = np.concatenate(means)
        self._grid.expect(np.concatenate(dues), told)

    def modulate(self, k: int, commands: Sequence[Command]) -> None:
        """Let stabiliser signals of guests act from t_k on.

        Raises:
            CosimError: the experiment has no guest that may send any.
        """
        if self._modulation is None:
            raise CosimError("a stabiliser signal came, but no guest has a unit")
        self._modulation.apply(tick_ns(k, self._run.clock.rate_hz), commands)

    def finish(self) -> None:
        """Record the last instant and complete the tables."""
        self._note_age(self._grid.tick)
        self._recorder.finish()
        self._recorder.close()
        self._write_log()
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
        self._write_log()

    def _write_log(self) -> None:
        """Write events.parquet: what happened when, with the ending of a run that is over."""
        rate, log, ending = self._grid.steps_per_second, self._grid.log, self._grid.ending
        columns = [
            Column("t_s", "s", "simulated time"),
            Column("what", "", "event, or why the run ended", "str"),
            Column("is_ending", "", "1 if the run ended with it", "int64"),
        ]
        is_ending = [ending is not None and text == ending.text for _, text in log]
        data = {
            "t_s": np.array([tick / rate for tick, _ in log], np.float64),
            "what": np.array([text for _, text in log], dtype=object),
            "is_ending": np.array(is_ending, np.int64),
        }
        write_table(self._folder / "events.parquet", columns, data)
        if self._modulation is not None:
            self._modulation.write(self._folder)

    def _record_ticks(self, first: int, last: int) -> range:
        start = -(-first // self._per_record) * self._per_record
        return range(start, last, self._per_record)

    def _frames_at(self, tick: int) -> bytes:
        """Integrate up to a tick and return its frames.

        There are none when the average needs none, or the run is over.
        """
        self._grid.advance(tick)
        now_ns = tick_ns(tick, self._grid.steps_per_second)
        if self._run.delay_ns is not None or self._grid.ending is not None:
            return FrameBundle(now_ns, np.zeros((0, 0), np.uint8)).to_bytes()
        reading = self._grid.reading()
        self._check_reading(reading)
        payloads = self._reporter.frames(
            now_ns, reading.v, reading.f_hz, reading.rocof_hz_s, reading.is_live
        )
        return FrameBundle(now_ns, payloads).to_bytes()

    def _check_reading(self, reading: Reading) -> None:
        """Refuse what no frame can carry.

        Raises:
            NumericalError: a PMU's phasor, frequency or its rate of change is not finite, or too
                large for single precision.
        """
        quantities = {
            "v_V": reading.v * self._base_v,
            "f_hz": reading.f_hz,
            "rocof_hz_s": reading.rocof_hz_s,
        }
        at_s = self._grid.tick / self._grid.steps_per_second
        for name, values in quantities.items():
            check_finite(values, partial(self._name_of, name), at_s, LARGEST_IN_A_FRAME)

    def _name_of(self, quantity: str, sensor: int) -> str:
        return f"{quantity}.B{self._sensors[sensor]}"

    def _note_age(self, tick: int) -> None:
        """Say how old the controllers' data are at the row of a tick, the next to be written."""
        if self._grid.ending is not None:
            return
        now_ns = tick_ns(tick, self._grid.steps_per_second)
        if self._run.delay_ns is None:
            age_s = self._belief.age_s(now_ns)
        else:
            age_s = np.full(len(self._run.fitted), min(now_ns, self._run.delay_ns) / NS_PER_S)
        self._recorder.age(age_s)


def _check_tags(bundle: DeliveryBundle, readings: Readings) -> None:
    """Refuse a sound frame that says itself that it was measured after its arrival.

    Raises:
        TimeContractBroken: there is one.
    """
    columns = bundle.columns
    place = readings.first_early(columns.payload, columns.arrival_ns)
    if place is not None:
        record = bundle.records[place]
        raise TimeContractBroken(
            f"{GRID}: frame {record['sequence']} of PMU {record['source']} arrived at "
            f"{record['arrival_ns']} ns, but its time tag says "
            f"{readings.tags_ns[record['payload']]} ns"
        )


def _average(run: GridRun, sensors: Sequence[int], weights: Floats) -> Average:
    """Return how wbar is formed inside the grid; held when frames bring it."""
    if run.delay_ns is None:
        return sensor_average(weights, mode=HELD)
    # An experiment is refused unless its delay is a whole number of steps.
    steps = round(run.delay_ns * run.settings.steps_per_second / NS_PER_S)
    return continuous_average(run.case, sensors, run.wams, run.settings.pss.average, steps)

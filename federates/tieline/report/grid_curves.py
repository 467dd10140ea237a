"""Prepares the grid's curves of one run: speeds, voltages, averages, stabilisers, ages."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from tieline.experiment.results import Run
from tieline.report.store import Chart, Curve, Floats, Store, areas_of, columns_of, rows_of

COI = "centre of inertia"
UNITS = "units"
LATER = "Hidden at first: {}, which the disturbance trips and which goes on alone."


def put_grid(store: Store, run: Run) -> None:
    """Add what `grid.parquet` of a run holds to a page."""
    grid, interconnection = run.table("grid", "t_s", "coi_pu"), run.map()
    time_s = grid["t_s"].to_numpy(dtype=np.float64)
    nominal_hz = float(run.told()["frequency_hz"])
    unit_areas, bus_areas = areas_of(interconnection)
    coi_hz = nominal_hz * grid["coi_pu"].to_numpy(dtype=np.float64)
    store.put("coi", "grid", time_s, [coi_hz])
    put = _Putter(store, run, time_s, unit_areas, bus_areas, run.tripped_units())
    put.units("speed", "speed_pu", nominal_hz)
    put.units("vt", "vt_pu")
    put.units("vs", "vs_pu")
    put.units("wbar", "wbar_pu", nominal_hz)
    put.units("age", "age_s", 1e3)
    put.buses("pmu", "f_hz")
    reference = Curve(COI, "coi", 0, COI, style="reference")
    gone = ", ".join(sorted(run.tripped_units()))
    hidden = LATER.format(gone) if gone else ""
    store.charts.append(Chart("coi", "System frequency", "Hz", [Curve(COI, "coi", 0, COI)]))
    _chart(store, "speed", "Rotor speeds", "frequency, Hz", put.curves, (reference,), hidden)
    _chart(store, "pmu", "Frequency at the PMUs", "frequency, Hz", put.curves, (reference,))
    _chart(store, "vt", "Terminal voltages", "voltage, pu", put.curves, note=hidden)
    _belief(store, put, time_s, coi_hz, reference, nominal_hz)
    _chart(store, "vs", "Stabiliser outputs", "output, pu", put.curves, note=hidden)
    _chart(
        store, "age", "Age of the PMU data that each controller acts on", "age, ms", put.curves,
        note="Mean over its PMUs of the time since the measurement that it holds.", from_zero=True,
    )  # fmt: skip


class _Putter:
    """Adds tables of one grid and remembers a curve for each row."""

    def __init__(
        self,
        store: Store,
        run: Run,
        time_s: Floats,
        unit_areas: Mapping[str, str],
        bus_areas: Mapping[str, str],
        tripped: set[str],
    ) -> None:
        self.curves: dict[str, list[Curve]] = {}
        self.wbar: Floats | None = None
        self._store, self._run, self._time_s = store, run, time_s
        self._areas = {**unit_areas, **bus_areas}
        self._tripped = tripped

    def units(self, name: str, quantity: str, factor: float = 1.0) -> None:
        """Add a quantity of every unit that has a value of it at any time."""
        elements, rows = self._read(quantity)
        self._put(name, elements, factor * rows, is_unit=True)

    def buses(self, name: str, quantity: str) -> None:
        """Add a quantity of every bus that has it."""
        elements, rows = self._read(quantity)
        self._put(name, elements, rows, is_unit=False)

    def _read(self, quantity: str) -> tuple[list[str], Floats]:
        """Return the elements that have a quantity, and its values; the others stay on disk."""
        names = [name for name in self._run.columns("grid") if name.startswith(f"{quantity}.")]
        table = self._run.table("grid", *names) if names else pd.DataFrame()
        elements = columns_of(table, quantity)
        return elements, rows_of(table, quantity, elements)

    def _put(self, name: str, elements: Sequence[str], rows: Floats, is_unit: bool) -> None:
        kept = [i for i, row in enumerate(rows) if not np.isnan(row).all()]
        if not kept:
            return
        names = [elements[i] for i in kept]
        self._store.put(name, "grid", self._time_s, rows[kept], names)
        if name == "wbar":
            self.wbar = rows[kept]
        self.curves[name] = [
            Curve(
                element if is_unit else f"bus {element[1:]}",
                name,
                row,
                self._group(element),
                element if is_unit else None,
                "hidden" if element in self._tripped else "plain",
            )
            for row, element in enumerate(names)
        ]

    def _group(self, element: str) -> str:
        if element in self._tripped:
            return f"{element} (tripped)"
        return self._areas.get(element) or UNITS


def _chart(
    store: Store,
    name: str,
    title: str,
    y: str,
    curves: Mapping[str, list[Curve]],
    more: Sequence[Curve] = (),
    note: str = "",
    from_zero: bool = False,
) -> None:
    if name in curves:
        drawn = [*more, *curves[name]]
        store.charts.append(Chart(name, title, y, drawn, note, from_zero=from_zero))


def _belief(
    store: Store,
    put: _Putter,
    time_s: Floats,
    coi_hz: Floats,
    reference: Curve,
    nominal_hz: float,
) -> None:
    """Add what each controller takes the average for, and by how much it is wrong."""
    if put.wbar is None:
        return
    curves = [c for c in put.curves["wbar"] if not (put.wbar[c.row] == nominal_hz).all()]
    if not curves:
        return
    store.put("error", "grid", time_s, 1e3 * (put.wbar - coi_hz))
    errors = [Curve(c.label, "error", c.row, c.group, c.unit, c.style) for c in curves]
    store.charts.append(
        Chart("wbar", "Average that each controller believes", "frequency, Hz",
              [reference, *curves], "Dashed: the true centre of inertia of the units in service.")
    )  # fmt: skip
    store.charts.append(
        Chart("error", "Error of the believed average", "believed - true, mHz", errors,
              "Against the true centre of inertia at the same instant.")
    )  # fmt: skip

"""Prepares the grid's curves of one run: speeds, voltages, averages, stabilisers, ages."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tieline.experiment.results import Run
from tieline.report.packing import thinned
from tieline.report.store import Chart, Curve, Floats, Store, areas_of, columns_of, rows_of

COI = "centre of inertia"
UNITS = "units"
LATER = "Hidden at first: {}, which the disturbance trips and which goes on alone."


def put_grid(store: Store, run: Run) -> None:
    """Add what `grid.parquet` of a run holds to a page."""
    grid, interconnection = run.values("grid", "t_s", "coi_pu"), run.map()
    time_s = grid["t_s"]
    nominal_hz = float(run.told()["frequency_hz"])
    unit_areas, bus_areas = areas_of(interconnection)
    coi_hz = nominal_hz * grid["coi_pu"]
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
    _belief(store, put, coi_hz, reference, nominal_hz)
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
        self._store, self._run, self._time_s = store, run, time_s
        self._areas = {**unit_areas, **bus_areas}
        self._tripped = tripped

    def units(self, name: str, quantity: str, factor: float = 1.0) -> None:
        """Add a quantity of every unit that has a value of it at any time."""
        self._put(name, *self.read(quantity, lambda rows: factor * rows), is_unit=True)

    def buses(self, name: str, quantity: str) -> None:
        """Add a quantity of every bus that has it."""
        self._put(name, *self.read(quantity, lambda rows: rows), is_unit=False)

    def read(
        self, quantity: str, made_of: Callable[[Floats], Floats]
    ) -> tuple[list[str], Floats, Floats]:
        """Return the elements that have a value of a quantity, and what is made of it, thinned.

        Returns (elements (n,), instants (m,), values (n, m)); at no time all of a long run's.
        """
        names = [name for name in self._run.columns("grid") if name.startswith(f"{quantity}.")]
        elements: list[str] = []
        kept: list[Floats] = []
        for table in self._run.blocks("grid", names):
            block = columns_of(table, quantity)
            rows = rows_of(table, quantity, block)
            with_value = np.flatnonzero(~np.isnan(rows).all(axis=1))
            elements += [block[i] for i in with_value]
            kept.append(thinned(self._time_s, made_of(rows[with_value]))[1])
        instants, _ = thinned(self._time_s, np.zeros((0, len(self._time_s))))
        return elements, instants, np.concatenate([np.zeros((0, len(instants))), *kept])

    def _put(
        self, name: str, names: Sequence[str], instants: Floats, rows: Floats, *, is_unit: bool
    ) -> None:
        if not names:
            return
        self._store.put(name, "grid", instants, rows, names)
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
    coi_hz: Floats,
    reference: Curve,
    nominal_hz: float,
) -> None:
    """Add what each controller takes the average for, and by how much it is wrong."""
    _, _, moved = put.read("wbar_pu", lambda rows: rows != 1.0)
    curves = [c for c in put.curves.get("wbar", ()) if moved[c.row].any()]
    if not curves:
        return
    _, instants, rows = put.read("wbar_pu", lambda rows: 1e3 * (nominal_hz * rows - coi_hz))
    store.put("error", "grid", instants, rows)
    errors = [Curve(c.label, "error", c.row, c.group, c.unit, c.style) for c in curves]
    store.charts.append(
        Chart("wbar", "Average that each controller believes", "frequency, Hz",
              [reference, *curves], "Dashed: the true centre of inertia of the units in service.")
    )  # fmt: skip
    store.charts.append(
        Chart("error", "Error of the believed average", "believed - true, mHz", errors,
              "Against the true centre of inertia at the same instant.")
    )  # fmt: skip

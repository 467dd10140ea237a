"""Gathers what the scripts of a page draw: curves over common axes, and charts of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.columns import Columns
from tieline.report.packing import packed, thinned

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """One curve of a chart.

    Attributes:
        label: its name.
        table, row: where its values are.
        group: the curves that the legend shows and hides as one.
        unit: the unit whose curve it is, if it is one's.
        style: `plain`; `reference`, which the others are held against; `hidden` until it is asked
            for; `step`, which holds until its instant.
    """

    label: str
    table: str
    row: int
    group: str
    unit: str | None = None
    style: str = "plain"


@dataclass(frozen=True)
class Chart:
    """A chart: its axes with their units, its curves, and what to know when one reads it.

    `kind` is `time` or `delay` (the horizontal axis), or `bars` over delays.
    """

    name: str
    title: str
    y: str
    curves: Sequence[Curve]
    note: str = ""
    x: str = "time, s"
    axis: str = "grid"
    kind: str = "time"
    from_zero: bool = False


@dataclass
class Store:
    """Axes, tables and charts of a page."""

    axes: dict[str, list[float]] = field(default_factory=dict)
    tables: dict[str, Any] = field(default_factory=dict)
    elements: dict[str, list[str]] = field(default_factory=dict)
    charts: list[Chart] = field(default_factory=list)

    def put(
        self,
        name: str,
        axis: str,
        instants: Floats,
        rows: Floats | Sequence[Floats],
        elements: Sequence[str] = (),
    ) -> None:
        """Add a table of curves (n, m) over instants (m,); thinned, if they are very many.

        `elements` names what each row is of.
        """
        matrix = np.asarray(rows, np.float64).reshape(-1, len(instants))
        at, kept = thinned(np.asarray(instants, np.float64), matrix)
        self.axes[axis] = np.round(at, 6).tolist()
        self.tables[name] = packed(kept) | {"axis": axis}
        self.elements[name] = list(elements)

    def curve(self, table: str, element: str) -> tuple[str, int] | None:
        """Return where the curve of an element (`G26`, `B61`) is, or None."""
        names = self.elements.get(table, [])
        return (table, names.index(element)) if element in names else None

    def data(self) -> dict[str, Any]:
        """Return all of it as plain data."""
        charts = [
            vars(chart) | {"curves": [vars(curve) for curve in chart.curves]}
            for chart in self.charts
        ]
        return {"axes": self.axes, "tables": self.tables, "charts": charts}


def columns_of(table: Columns, quantity: str) -> list[str]:
    """Return the elements (`G26`, `B61`) that a table has a quantity of, in its order."""
    prefix = f"{quantity}."
    return [name.removeprefix(prefix) for name in table if name.startswith(prefix)]


def rows_of(table: Columns, quantity: str, elements: Sequence[str]) -> Floats:
    """Return (n, m) a quantity of some elements, NaN where there is no value."""
    return np.array([table[f"{quantity}.{element}"] for element in elements], np.float64)


def area_name(area: str) -> str:
    """Return an area as the legend calls it; some cases have but a number for one."""
    return f"area {area}" if area.isdigit() else area


def areas_of(interconnection: Mapping[str, Any] | None) -> tuple[dict[str, str], dict[str, str]]:
    """Return the area of each unit, and of each bus as `B61`; nothing without a map."""
    if interconnection is None:
        return {}, {}
    area = {s["name"]: area_name(s["area"]) for s in interconnection["stations"]}
    units = {unit["name"]: area[unit["station"]] for unit in interconnection["units"]}
    buses = {
        f"B{bus}": area[station["name"]]
        for station in interconnection["stations"]
        for bus in station["buses"]
    }
    return units, buses

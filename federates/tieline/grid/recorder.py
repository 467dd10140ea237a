"""grid.parquet: what is recorded of the grid, one row an instant."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.grid.finite import check_finite
from tieline.grid.simulation import Grid
from tieline.tables import Column, TableStream

Floats = NDArray[np.float64]

ROWS_PER_BLOCK = 60
"""Rows that are written at once: a second of them is the most that a killed process loses."""

_UNIT_QUANTITIES = (
    ("speed_pu", "omega", "pu", "rotor speed of {}"),
    ("vt_pu", "vt", "pu", "terminal voltage of {}"),
    ("Efd_pu", "Efd", "pu", "field voltage of {}"),
    ("vs_pu", "v_s", "pu", "stabiliser output of {}"),
    ("Pe_pu", "Pe", "pu on the system base", "electrical power of {}"),
    ("Pm_pu", "Pm", "pu on the machine base", "mechanical power of {}"),
    ("wbar_pu", "wbar", "pu", "average speed that the controller of {} believes"),
)

_NAMES = [name for name, *_ in _UNIT_QUANTITIES]
_SIGNALS = [signal for _, signal, *_ in _UNIT_QUANTITIES]


class Recorder:
    """Writes rows of the grid's quantities, in blocks.

    Columns are `t_s`, `coi_pu`, then QUANTITY_UNIT.ELEMENT: units by name, buses as B61. The
    column of a unit that was tripped goes on as the unit is simulated, alone.

    Args:
        path: the Parquet file to make.
        grid: what is recorded.
        per_row: steps of the grid from row to row.
        sensors: bus numbers with a PMU, for `f_hz`.
        fitted: (units,) which units have a controller, for `age_s`.
    """

    def __init__(
        self, path: Path, grid: Grid, per_row: int, sensors: Sequence[int], fitted: Floats
    ) -> None:
        self._grid = grid
        case = grid.system.case
        self._fitted = np.flatnonzero(fitted)
        columns = [
            Column("t_s", "s", "simulated time"),
            Column("coi_pu", "pu", "speed of the centre of inertia of the units in service"),
        ]
        for name, _, unit, text in _UNIT_QUANTITIES:
            columns += [Column(f"{name}.{u}", unit, text.format(u)) for u in case.units]
        columns += [
            Column(f"age_s.{case.units[u]}", "s", "mean age of the frames that it holds")
            for u in self._fitted
        ]
        columns += [Column(f"f_hz.B{b}", "Hz", f"PMU frequency at bus {b}") for b in sensors]
        columns += [Column(f"v_pu.B{b}", "pu", f"voltage of bus {b}") for b in case.buses.number]
        self._names = [column.name for column in columns]
        tripped = "a unit that is tripped goes on as it is simulated, alone"
        self._stream = TableStream(path, columns, {"tripped_units": tripped})
        self._ages: list[Floats] = []
        scale = np.ones((len(_UNIT_QUANTITIES), len(case.units)))
        scale[_NAMES.index("Pe_pu")] = case.unit_MVA / case.base.base_MVA
        self._units_end = 2 + scale.size
        grid.record(per_row, _SIGNALS, scale, ROWS_PER_BLOCK, self._write)

    def age(self, age_s: Floats) -> None:
        """Say how old the controllers' data (controllers,) are at the next row, mean by unit, s."""
        self._ages.append(age_s)

    def finish(self) -> None:
        """Add the row of the grid as it is, unless the run is over.

        Raises:
            NumericalError: a value of a row is not finite.
        """
        self._grid.record_now()

    def close(self) -> None:
        """Write what is left and finish the file; a second call does nothing.

        Raises:
            NumericalError: a value of a row is not finite; the file then ends before that row.
        """
        try:
            self._grid.hand_over()
        finally:
            self._stream.close()

    def _write(self, rows: Floats) -> None:
        """Write rows (rows, values) and their ages, up to the first that is not finite."""
        ages = np.array(self._ages[: len(rows)]).reshape(len(rows), len(self._fitted))
        del self._ages[: len(rows)]
        at = self._units_end
        block = np.concatenate([rows[:, :at], ages, rows[:, at:]], axis=1)
        is_sound = np.isfinite(block).all(axis=1)
        sound = len(rows) if is_sound.all() else int(np.argmin(is_sound))
        columns = np.ascontiguousarray(block[:sound].T)
        self._stream.append(dict(zip(self._names, columns, strict=True)))
        self._stream.flush()
        if sound < len(rows):
            self._refuse(block[sound])

    def _refuse(self, row: Floats) -> None:
        # The centre of inertia comes last: where it is not finite, a unit's speed is the cause.
        order = np.roll(np.arange(len(row)), -2)
        check_finite(row[order], lambda i: self._names[order[i]], float(row[0]))

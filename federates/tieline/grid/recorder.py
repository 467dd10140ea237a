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

_UNIT_QUANTITIES = (
    ("speed_pu", "omega", "pu", "rotor speed of {}"),
    ("vt_pu", "vt", "pu", "terminal voltage of {}"),
    ("Efd_pu", "Efd", "pu", "field voltage of {}"),
    ("vs_pu", "v_s", "pu", "stabiliser output of {}"),
    ("Pe_pu", "Pe", "pu on the system base", "electrical power of {}"),
    ("Pm_pu", "Pm", "pu on the machine base", "mechanical power of {}"),
    ("wbar_pu", "wbar", "pu", "average speed that the controller of {} believes"),
)


class Recorder:
    """Writes rows of the grid's quantities, in blocks.

    Columns are `t_s`, `coi_pu`, then QUANTITY_UNIT.ELEMENT: units by name, buses as B61. The
    column of a unit that was tripped goes on as the unit is simulated, alone.

    Args:
        path: the Parquet file to make.
        grid: what is recorded.
        sensors: bus numbers with a PMU, for `f_hz`.
        fitted: (units,) which units have a controller, for `age_s`.
    """

    def __init__(self, path: Path, grid: Grid, sensors: Sequence[int], fitted: Floats) -> None:
        self._grid = grid
        case = grid.system.case
        self._to_system_base = case.unit_MVA / case.base.base_MVA
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
        self._block = np.empty((len(columns), ROWS_PER_BLOCK))
        self._filled = 0

    def record(self, age_s: Floats) -> None:
        """Add a row for the grid as it is; `age_s` (controllers,) is of its controllers' data.

        Raises:
            NumericalError: a value of the row is not finite; the row is left out.
        """
        grid = self._grid
        parts: list[Floats] = [
            np.array([grid.tick / grid.steps_per_second, grid.centre_of_inertia()])
        ]
        for name, signal, _, _ in _UNIT_QUANTITIES:
            values = grid.signal(signal)
            parts.append(values * self._to_system_base if name == "Pe_pu" else values)
        parts += [age_s, grid.reading().f_hz, np.abs(grid.voltages())]
        row = np.concatenate(parts)
        # The centre of inertia comes last: where it is not finite, a unit's speed is the cause.
        order = np.roll(np.arange(len(row)), -2)
        check_finite(row[order], lambda i: self._names[order[i]], float(row[0]))
        self._block[:, self._filled] = row
        self._filled += 1
        if self._filled == ROWS_PER_BLOCK:
            self._write()

    def close(self) -> None:
        """Write what is left and finish the file; a second call does nothing."""
        self._write()
        self._stream.close()

    def _write(self) -> None:
        if self._filled:
            rows = self._block[:, : self._filled]
            self._stream.append(dict(zip(self._names, rows.copy(), strict=True)))
            self._stream.flush()
        self._filled = 0

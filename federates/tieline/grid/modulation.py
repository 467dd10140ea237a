"""Stabiliser signals that guests send: clipped, put on the exciters, and written down."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tieline.cosim.guests import Command, GuestSettings
from tieline.errors import InputError
from tieline.grid.simulation import Grid
from tieline.tables import Column, write_table
from tieline.units import ns_to_seconds

_COLUMNS = (
    Column("t_s", "s", "from when it acts"),
    Column("sent_s", "s", "stamp of the guest's message"),
    Column("guest", "", "who sent it", "str"),
    Column("unit", "", "whose exciter it acts on", "str"),
    Column("asked_pu", "pu", "stabiliser signal as sent"),
    Column("v_s_pu", "pu", "stabiliser signal after the guest's limit"),
)


class Modulation:
    """What guests add to the stabiliser signals of their units; each signal stays until the next.

    Args:
        grid: whose exciters they are.
        owners: the guest of each unit.

    Raises:
        InputError: a unit has no exciter.
    """

    def __init__(self, grid: Grid, owners: Mapping[str, GuestSettings]) -> None:
        case = grid.system.case
        bare = [unit for unit in owners if case.device("exciter", unit) is None]
        if bare:
            raise InputError([f"federation.guests: '{unit}' has no exciter" for unit in bare])
        self._grid = grid
        self._rows = {unit: case.units.index(unit) for unit in owners}
        self._limits = {unit: owner.limit for unit, owner in owners.items()}
        self._now = dict.fromkeys(owners, 0.0)
        self._log: list[tuple[float, float, str, str, float, float]] = []

    def apply(self, now_ns: int, commands: Sequence[Command]) -> None:
        """Let commands act from `now_ns` on, the last of each unit for good."""
        for command in commands:
            unit, limit = command.unit, self._limits[command.unit]
            v_s_pu = min(limit, max(-limit, command.v_s_pu))
            if v_s_pu != self._now[unit]:
                self._grid.modulate(self._rows[unit], v_s_pu - self._now[unit])
                self._now[unit] = v_s_pu
            instants = ns_to_seconds(now_ns), ns_to_seconds(command.stamp_ns)
            self._log.append((*instants, command.guest, unit, command.v_s_pu, v_s_pu))

    def write(self, folder: Path) -> None:
        """Write modulation.parquet: every signal that came."""
        parts = list(zip(*self._log, strict=True)) or [()] * len(_COLUMNS)
        data = {
            column.name: np.array(part, object if column.name in ("guest", "unit") else np.float64)
            for column, part in zip(_COLUMNS, parts, strict=True)
        }
        write_table(folder / "modulation.parquet", list(_COLUMNS), data)

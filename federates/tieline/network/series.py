"""Writes what happened in each of many equal windows: of every link, and of every controller."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.network.age import NEVER
from tieline.network.engine import Engine
from tieline.network.spec import NetworkSpec
from tieline.tables import Column, TableStream
from tieline.units import NS_PER_S

_WINDOW_END = Column("t_s", "s", "end of the window")

LINK_SERIES_COLUMNS = (
    _WINDOW_END,
    Column("from", "", "node that sends", "str"),
    Column("to", "", "node that receives", "str"),
    Column("packets", "", "packets put on the link, lost ones and cross traffic included", "int64"),
    Column("bytes", "", "bytes put on the link, link-layer bytes included", "int64"),
    Column("utilisation", "", "share of the window in transmission"),
    Column("dropped_queue", "", "packets that found the queue full", "int64"),
    Column("dropped_loss", "", "packets lost on the link", "int64"),
    Column("dropped_down", "", "packets lost when the link went down, or while it was", "int64"),
    Column("queue", "", "packets waiting at the end of the window", "int64"),
    Column("max_queue", "", "most packets waiting at once in the window", "int64"),
)

CONTROLLER_SERIES_COLUMNS = (
    _WINDOW_END,
    Column("controller", "", "controller", "str"),
    Column("unit", "", "unit of the controller", "str"),
    Column("delivered", "", "packets that it could use from an instant in the window", "int64"),
    Column("lost", "", "packets to it that were dropped in the window", "int64"),
    Column("delay_mean_s", "s", "mean combined delay of the delivered packets"),
    Column("delay_p50_s", "s", "their median, by nearest rank"),
    Column("delay_p95_s", "s", "their 95th percentile, by nearest rank"),
    Column("delay_max_s", "s", "their longest delay"),
    Column("age_mean_s", "s", "age of the freshest frame at the window's end, mean of the PMUs"),
    Column("age_max_s", "s", "the same of the PMU whose frame is the oldest"),
)

# A delay has 48 bits, which is 78 hours, below the number of its controller.
_DELAY_BITS = 48


class LinkSeries:
    """link_series.parquet: one row for each direction of a link that was in use in a window."""

    def __init__(self, path: Path, engine: Engine) -> None:
        self._stream = TableStream(path, LINK_SERIES_COLUMNS)
        self._engine = engine
        links = engine.links()
        self._from = np.array([link.origin for link in links], dtype=object)
        self._to = np.array([link.target for link in links], dtype=object)
        # Read once, so that it is compiled before the federation waits for an answer.
        self._before = engine.link_counters()

    def close_window(self, end_ns: int, length_ns: int) -> None:
        """Write the window that the engine has just run to the end of."""
        now, before = self._engine.link_counters(), self._before
        self._before = now
        names = ("packets", "bytes", "busy_ns", "dropped_queue", "dropped_loss", "dropped_down")
        gained = {name: now[name] - before[name] for name in names}
        used = gained["busy_ns"] + sum(gained[name] for name in names[3:])
        rows = np.flatnonzero(used + now["max_queue"])
        busy_ns = gained.pop("busy_ns")[rows]
        self._stream.append(
            {
                "t_s": np.full(len(rows), end_ns / NS_PER_S),
                "from": self._from[rows],
                "to": self._to[rows],
                "utilisation": busy_ns / length_ns,
                "queue": now["queue"][rows],
                "max_queue": now["max_queue"][rows],
                **{name: values[rows] for name, values in gained.items()},
            }
        )

    def flush(self) -> None:
        """Hand what there is to the operating system, so that a kill loses nothing of it."""
        self._stream.flush()

    def close(self) -> None:
        """Finish the file."""
        self._stream.close()


class ControllerSeries:
    """controller_series.parquet: one row for each controller and window."""

    def __init__(self, path: Path, spec: NetworkSpec, flow_of: NDArray[np.int64]) -> None:
        self._stream = TableStream(path, CONTROLLER_SERIES_COLUMNS)
        self._names = np.array([site.name for site in spec.destinations], dtype=object)
        self._units = np.array([site.unit for site in spec.destinations], dtype=object)
        self._flow_of = flow_of
        self._keys: list[NDArray[np.int64]] = []
        self._lost = np.zeros(len(spec.destinations), dtype=np.int64)

    def add(
        self,
        controllers: NDArray[np.uint16],
        delays_ns: NDArray[np.int64],
        drops: NDArray[np.void],
    ) -> None:
        """Take what ended in the window: to which controllers packets came, how late, and drops."""
        keys = controllers.astype(np.int64)
        keys <<= _DELAY_BITS
        keys |= delays_ns
        self._keys.append(keys)
        if len(drops):
            self._lost += np.bincount(drops["destination"], minlength=len(self._lost))

    def close_window(self, end_ns: int, measured_ns: NDArray[np.int64]) -> None:
        """Write the window.

        Args:
            end_ns: its end.
            measured_ns: (flows,) measurement of the freshest frame of each flow, or `NEVER`.
        """
        keys = np.sort(np.concatenate([np.empty(0, np.int64), *self._keys]))
        delays_ns = keys & ((1 << _DELAY_BITS) - 1)
        delivered = np.bincount(keys >> _DELAY_BITS, minlength=len(self._names))
        sums_ns = np.bincount(keys >> _DELAY_BITS, delays_ns, len(self._names))
        held_ns = measured_ns[self._flow_of]
        is_held = held_ns != NEVER
        ages_ns = np.where(is_held, end_ns - held_ns, 0)
        self._stream.append(
            {
                "t_s": np.full(len(self._names), end_ns / NS_PER_S),
                "controller": self._names,
                "unit": self._units,
                "delivered": delivered,
                "lost": self._lost,
                "delay_mean_s": _ratio(sums_ns, delivered) / NS_PER_S,
                "delay_p50_s": _ranked(delays_ns, delivered, 0.5) / NS_PER_S,
                "delay_p95_s": _ranked(delays_ns, delivered, 0.95) / NS_PER_S,
                "delay_max_s": _ranked(delays_ns, delivered, 1.0) / NS_PER_S,
                "age_mean_s": _ratio(ages_ns.sum(axis=0), is_held.sum(axis=0)) / NS_PER_S,
                "age_max_s": _ratio(ages_ns.max(axis=0), is_held.any(axis=0)) / NS_PER_S,
            }
        )
        self._keys.clear()
        self._lost[:] = 0

    def flush(self) -> None:
        """Hand what there is to the operating system, so that a kill loses nothing of it."""
        self._stream.flush()

    def close(self) -> None:
        """Finish the file."""
        self._stream.close()


def _ratio(sums: NDArray[Any], counts: NDArray[Any]) -> NDArray[np.float64]:
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _ranked(
    delays_ns: NDArray[np.int64], counts: NDArray[np.int64], share: float
) -> NDArray[np.float64]:
    """Return the delay that `share` of each controller's do not exceed, NaN without any.

    Args:
        delays_ns: controller after controller, ascending for each.
        counts: (controllers,) how many each has.
        share: above 0, at most 1.
    """
    firsts = np.cumsum(counts) - counts
    ranks = np.maximum(1, np.ceil(share * counts).astype(np.int64))
    has_any = counts > 0
    values = np.full(len(counts), np.nan)
    values[has_any] = delays_ns[(firsts + ranks - 1)[has_any]]
    return values

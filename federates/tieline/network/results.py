"""Writes what the network did: flows, links, delays and, on request, every packet."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.network.age import NEVER, AgeOfInformation
from tieline.network.ended import Ended
from tieline.network.engine import DELIVERED, LinkUse, order_of
from tieline.network.spec import NetworkSpec
from tieline.network.stats import DELAY_BIN_NS, DELAY_BINS, FlowStatistics
from tieline.tables import Column, TableStream, write_table
from tieline.units import NS_PER_S

_PERCENTILE = "within 0.8 % of its excess over the flow's least possible delay"

FLOW_COLUMNS = (
    Column("flow", "", "number of the flow: source by source, destination by destination", "int64"),
    Column("source", "", "PMU", "str"),
    Column("destination", "", "controller", "str"),
    Column("source_bus", "", "bus of the PMU", "int64"),
    Column("unit", "", "unit of the controller", "str"),
    Column("hops", "", "links on the route", "int64"),
    Column("sent", "", "packets whose frame was measured", "int64"),
    Column("delivered", "", "packets that the controller could use by the end", "int64"),
    Column("dropped_queue", "", "packets dropped at a full queue", "int64"),
    Column("dropped_loss", "", "packets lost on a link", "int64"),
    Column("dropped_down", "", "packets lost with a link that went down, or was", "int64"),
    Column("in_flight", "", "packets under way at the end", "int64"),
    Column("delay_mean_s", "s", "mean combined delay, measurement to use by the controller"),
    Column("delay_min_s", "s", "least combined delay"),
    Column("delay_p50_s", "s", f"median combined delay, {_PERCENTILE}"),
    Column("delay_p95_s", "s", f"95th percentile of the combined delay, {_PERCENTILE}"),
    Column("delay_max_s", "s", "longest combined delay"),
    Column("jitter_s", "s", "mean absolute delay variation of consecutive packets (RFC 3393)"),
    Column("loss", "", "dropped packets as a share of those delivered or dropped"),
    Column("jitter_smoothed_s", "s", "interarrival jitter of RFC 3550 after the last arrival"),
    Column("pdv_p95_s", "s", f"95th percentile of the delay beyond the least one, {_PERCENTILE}"),
    Column("pdv_p999_s", "s", f"the same, 99.9th percentile (RFC 5481), {_PERCENTILE}"),
    Column("loss_periods", "", "runs of consecutive lost packets (RFC 3357)", "int64"),
    Column("loss_period_mean", "", "mean length of these runs, packets"),
    Column("loss_period_max", "", "length of the longest one, packets", "int64"),
    Column("loss_distance_mean", "", "mean step in number from a lost packet to the next lost one"),
    Column("reordered", "", "packets that arrived after a later one (RFC 4737)", "int64"),
    Column("reordered_share", "", "reordered packets as a share of those delivered"),
    Column("extent_mean", "", "mean reordering extent of the reordered packets, packets"),
    Column("extent_max", "", "longest reordering extent, packets", "int64"),
    Column("age_mean_s", "s", "age of the freshest frame held, mean over time from the first on"),
    Column("age_peak_s", "s", "age just before a fresher frame arrives, mean of these peaks"),
    Column("age_max_s", "s", "greatest age"),
)

AGE_COLUMNS = (
    Column("controller", "", "controller", "str"),
    Column("unit", "", "unit of the controller", "str"),
    Column("pmus", "", "PMUs of which it got a frame", "int64"),
    Column("age_mean_s", "s", "mean age over time, mean of the PMUs"),
    Column("age_peak_s", "s", "mean peak age, mean of the PMUs"),
    Column("age_max_s", "s", "greatest age, of the PMU and at the instant where it is greatest"),
)

LINK_COLUMNS = (
    Column("from", "", "node that sends", "str"),
    Column("to", "", "node that receives", "str"),
    Column("rate_bps", "bit/s", "rate of this direction", "int64"),
    Column("packets", "", "packets put on the link, lost ones and cross traffic included", "int64"),
    Column("bytes", "", "bytes put on the link, link-layer bytes included", "int64"),
    Column("dropped_queue", "", "packets that found the queue full", "int64"),
    Column("dropped_loss", "", "packets lost on the link", "int64"),
    Column("dropped_down", "", "packets lost when the link went down, or while it was", "int64"),
    Column("utilisation", "", "share of the time in transmission"),
    Column("max_queue", "", "most packets waiting besides the one in transmission", "int64"),
)

DELAY_COLUMNS = (
    Column("bin_low_s", "s", "lower edge of the bin, included"),
    Column("bin_high_s", "s", "upper edge of the bin, excluded; the longest delay in the last bin"),
    Column("count", "", "delivered PMU packets, all flows, by combined delay", "int64"),
)

PACKET_COLUMNS = (
    Column("flow", "", "number of the flow", "int64"),
    Column("sequence", "", "number of the frame", "int64"),
    Column("measured_ns", "ns", "instant of measurement", "int64"),
    Column("ended_ns", "ns", "when the controller could use it, or when it was dropped", "int64"),
    Column("outcome", "", "0 delivered, 1 dropped at queue, 2 lost on link, 3 link down", "uint8"),
)


def write_flows(
    path: Path, spec: NetworkSpec, statistics: FlowStatistics, age: AgeOfInformation, end_ns: int
) -> None:
    """Write flows.parquet: one row a PMU flow."""
    sources = [spec.sources[flow.source] for flow in spec.flows]
    destinations = [spec.destinations[flow.destination] for flow in spec.flows]
    dropped = statistics.dropped_queue + statistics.dropped_loss + statistics.dropped_down
    ended = statistics.delivered + dropped
    order = statistics.order()
    least_ns = statistics.min_ns()
    write_table(
        path,
        FLOW_COLUMNS,
        {
            "flow": np.arange(len(spec.flows)),
            "source": [source.name for source in sources],
            "destination": [destination.name for destination in destinations],
            "source_bus": np.array([source.bus for source in sources], dtype=np.int64),
            "unit": [destination.unit for destination in destinations],
            "hops": np.array([len(flow.route) - 1 for flow in spec.flows], dtype=np.int64),
            "sent": statistics.sent,
            "delivered": statistics.delivered,
            "dropped_queue": statistics.dropped_queue,
            "dropped_loss": statistics.dropped_loss,
            "dropped_down": statistics.dropped_down,
            "in_flight": statistics.in_flight,
            "delay_mean_s": statistics.mean_ns() / NS_PER_S,
            "delay_min_s": least_ns / NS_PER_S,
            "delay_p50_s": statistics.percentiles_ns(0.5) / NS_PER_S,
            "delay_p95_s": statistics.percentiles_ns(0.95) / NS_PER_S,
            "delay_max_s": statistics.max_ns() / NS_PER_S,
            "jitter_s": order.variation_ns / NS_PER_S,
            "loss": np.where(ended > 0, dropped / np.maximum(ended, 1), np.nan),
            "jitter_smoothed_s": statistics.smoothed_jitter_ns() / NS_PER_S,
            "pdv_p95_s": (statistics.percentiles_ns(0.95) - least_ns) / NS_PER_S,
            "pdv_p999_s": (statistics.percentiles_ns(0.999) - least_ns) / NS_PER_S,
            "loss_periods": order.loss_periods,
            "loss_period_mean": order.loss_period_mean,
            "loss_period_max": order.loss_period_max,
            "loss_distance_mean": order.loss_distance_mean,
            "reordered": order.reordered,
            "reordered_share": order.reordered_share,
            "extent_mean": order.extent_mean,
            "extent_max": order.extent_max,
            "age_mean_s": age.mean_ns(end_ns) / NS_PER_S,
            "age_peak_s": age.peak_mean_ns() / NS_PER_S,
            "age_max_s": age.max_ns(end_ns) / NS_PER_S,
        },
    )


def write_ages(
    path: Path,
    spec: NetworkSpec,
    flow_of: NDArray[np.int64],
    age: AgeOfInformation,
    end_ns: int,
) -> None:
    """Write ages.parquet: one row a controller."""
    write_table(
        path,
        AGE_COLUMNS,
        {
            "controller": [destination.name for destination in spec.destinations],
            "unit": [destination.unit for destination in spec.destinations],
            "pmus": (age.measured_ns[flow_of] != NEVER).sum(axis=0),
            "age_mean_s": _mean_of_held(age.mean_ns(end_ns)[flow_of]) / NS_PER_S,
            "age_peak_s": _mean_of_held(age.peak_mean_ns()[flow_of]) / NS_PER_S,
            "age_max_s": np.fmax.reduce(age.max_ns(end_ns)[flow_of], axis=0) / NS_PER_S,
        },
    )


def write_links(path: Path, links: Sequence[LinkUse], duration_ns: int) -> None:
    """Write links.parquet: one row a direction of a link."""
    whole_ns = max(duration_ns, 1)
    write_table(
        path,
        LINK_COLUMNS,
        {
            "from": [link.origin for link in links],
            "to": [link.target for link in links],
            "rate_bps": _counts(link.rate_bps for link in links),
            "packets": _counts(link.packets for link in links),
            "bytes": _counts(link.bytes for link in links),
            "dropped_queue": _counts(link.dropped_queue for link in links),
            "dropped_loss": _counts(link.dropped_loss for link in links),
            "dropped_down": _counts(link.dropped_down for link in links),
            "utilisation": _counts(link.busy_ns for link in links) / whole_ns,
            "max_queue": _counts(link.max_queue for link in links),
        },
    )


def write_delays(path: Path, statistics: FlowStatistics) -> None:
    """Write delays.parquet: the histogram from its first to its last occupied bin."""
    occupied = np.flatnonzero(statistics.delay_counts)
    first, last = (occupied[0], occupied[-1]) if len(occupied) else (0, -1)
    bins = np.arange(first, last + 1)
    high_ns = (bins + 1) * float(DELAY_BIN_NS)
    if last == DELAY_BINS:
        high_ns[-1] = np.nanmax(statistics.max_ns())
    write_table(
        path,
        DELAY_COLUMNS,
        {
            "bin_low_s": bins * (DELAY_BIN_NS / NS_PER_S),
            "bin_high_s": high_ns / NS_PER_S,
            "count": statistics.delay_counts[first : last + 1],
        },
    )


class PacketLog:
    """packets.parquet, written as packets end; those in flight at the end have no row."""

    def __init__(self, path: Path) -> None:
        self._stream = TableStream(path, PACKET_COLUMNS)

    def add(self, arrived: Ended, lost: Ended, reasons: NDArray[np.uint8]) -> None:
        """Add the packets of an outcome.

        They stand in the order in which they ended, arrivals before drops of the same instant.
        """
        both = Ended(*(np.concatenate(columns) for columns in zip(arrived, lost, strict=True)))
        delivered = np.full(len(arrived.flows), DELIVERED, dtype=np.uint8)
        order = order_of(both.ended_ns)
        self._stream.append(
            {
                "flow": both.flows[order],
                "sequence": both.sequences[order],
                "measured_ns": both.measured_ns[order],
                "ended_ns": both.ended_ns[order],
                "outcome": np.concatenate([delivered, reasons])[order],
            }
        )

    def flush(self) -> None:
        """Hand what there is to the operating system, so that a kill loses nothing of it."""
        self._stream.flush()

    def close(self) -> None:
        """Finish the file."""
        self._stream.close()


def _counts(values: Iterable[int]) -> NDArray[np.int64]:
    return np.fromiter(values, dtype=np.int64)


def _mean_of_held(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (controllers,) the mean over the sources that have a value, NaN without any."""
    has_value = ~np.isnan(values)
    counts = has_value.sum(axis=0)
    sums = np.where(has_value, values, 0.0).sum(axis=0)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)

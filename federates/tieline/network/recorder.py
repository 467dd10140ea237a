"""Keeps the statistics of a run of the network, window by window, and writes its tables."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError
from tieline.network.age import AgeOfInformation
from tieline.network.ended import ended
from tieline.network.engine import NO_ARRIVALS, NO_DROPS, Engine, Outcome, joined
from tieline.network.results import PacketLog, write_ages, write_delays, write_flows, write_links
from tieline.network.series import ControllerSeries, LinkSeries
from tieline.network.spec import NetworkSpec, least_delay_ns
from tieline.network.stats import FlowStatistics
from tieline.network.streams_used import STREAMS, write_streams
from tieline.units import NS_PER_S

_MOST_HELD = 8_192
"""Packets that are held before they are taken into account; their records have 16 bytes each."""


class Recorder:
    """What becomes a network's tables.

    The caller runs the engine from one of the instants of `stops` to the next and hands over what
    ended on the way, so that windows are exact however often the federates meet. It is taken into
    account a window at a time, or some thousand packets: many at once cost far less than few.

    Args:
        folder: where the tables go.
        spec: sources, destinations and flows.
        engine: what carries the packets.
        rate_hz: frames a second.
        window_ns: length of the windows of the series, or None to write none.
        record_packets: whether packets.parquet is written.
    """

    def __init__(
        self,
        folder: Path,
        spec: NetworkSpec,
        engine: Engine,
        rate_hz: int,
        window_ns: int | None,
        record_packets: bool,
    ) -> None:
        self._folder = folder
        self._spec = spec
        self._engine = engine
        self._rate_hz = rate_hz
        flow_of = np.arange(len(spec.flows)).reshape(len(spec.sources), len(spec.destinations))
        self._flow_of = flow_of
        least_ns = [least_delay_ns(spec, flow) for flow in spec.flows]
        self._flows = FlowStatistics(np.array(least_ns, dtype=np.int64), flow_of)
        self._age = AgeOfInformation(len(spec.flows))
        self._log = PacketLog(folder / "packets.parquet") if record_packets else None
        self._window_ns = window_ns
        self._windows = 0
        self._until_ns = 0
        self._flushed_ns = 0
        self._held: list[Outcome] = []
        self._held_packets = 0
        if window_ns is not None:
            self._links = LinkSeries(folder / "link_series.parquet", engine)
            path = folder / "controller_series.parquet"
            self._controllers = ControllerSeries(path, spec, flow_of)
        write_streams(folder / STREAMS, engine.streams())
        # Compiles, where that is still to be done, before the federation waits for an answer.
        self._take(Outcome(NO_ARRIVALS, NO_DROPS))

    def stops(self, until_ns: int) -> list[int]:
        """Return the ends of windows that the engine must stop at, and `until_ns`."""
        if self._window_ns is None:
            return [until_ns]
        first = (self._windows + 1) * self._window_ns
        ends = range(first, until_ns + 1, self._window_ns)
        return [*ends] if until_ns in ends else [*ends, until_ns]

    def add_sent(self, sources: NDArray[np.int64], sequence: int) -> None:
        """Count frame `sequence` of these sources."""
        self._flows.add_sent(sources, sequence)

    def add(self, outcome: Outcome, until_ns: int) -> None:
        """Take what ended up to `until_ns`, the next of the `stops`; it is kept for a while.

        Raises:
            CosimError: a packet ended twice.
        """
        self._held.append(outcome)
        self._held_packets += len(outcome.arrivals) + len(outcome.drops)
        self._until_ns = until_ns
        if self._held_packets >= _MOST_HELD:
            self._settle()
        if self._window_ns is not None and until_ns == (self._windows + 1) * self._window_ns:
            self._close_window(self._window_ns)
        if until_ns - self._flushed_ns >= NS_PER_S:
            self._flush()

    def check(self) -> None:
        """Hold the statistics against the engine's own counts.

        The engine checks itself whenever it is run; this finds what was lost on the way from there.

        Raises:
            CosimError: a flow has more packets ended than sent, or, in a network without cross
                traffic and connections, whose packets only the engine counts, the sums are not
                the engine's.
        """
        self._settle()
        flows, counts = self._flows, self._engine.counts()
        counts.check(self._until_ns)
        for flow in np.flatnonzero(flows.in_flight < 0)[:1]:
            raise CosimError(
                f"flow {flow} has more packets ended than sent at {self._until_ns} ns: "
                f"{flows.sent[flow]} sent, {flows.in_flight[flow]} in flight"
            )
        told = flows.counts()
        is_alone = not self._spec.cross_flows and self._spec.transport != "tcp"
        if is_alone and told != counts:
            raise CosimError(
                f"the statistics and the engine differ at {self._until_ns} ns: {told} and {counts}"
            )

    def write(self) -> None:
        """Write the tables as far as the run came; the last window may be a shorter one.

        Nothing can be added after it; writing again does no harm.
        """
        self._settle()
        end_ns = self._until_ns
        write_flows(self._folder / "flows.parquet", self._spec, self._flows, self._age, end_ns)
        write_links(self._folder / "links.parquet", self._engine.links(), end_ns)
        write_delays(self._folder / "delays.parquet", self._flows)
        write_ages(self._folder / "ages.parquet", self._spec, self._flow_of, self._age, end_ns)
        write_streams(self._folder / STREAMS, self._engine.streams())
        if self._log is not None:
            self._log.close()
        if self._window_ns is not None:
            rest_ns = end_ns - self._windows * self._window_ns
            if rest_ns > 0:
                self._close_window(rest_ns)
            self._links.close()
            self._controllers.close()
            self._window_ns = None

    def _settle(self) -> None:
        """Take into account whatever is held."""
        if self._held:
            outcome = joined(self._held)
            self._held.clear()
            self._held_packets = 0
            self._take(outcome)

    def _take(self, outcome: Outcome) -> None:
        arrivals, drops = outcome.arrivals, outcome.drops
        arrived = ended(arrivals, self._flow_of, self._rate_hz)
        lost = ended(drops, self._flow_of, self._rate_hz)
        self._flows.add(arrived, lost, drops["reason"])
        self._age.add(arrived.flows, arrived.ended_ns, arrived.measured_ns)
        if self._log is not None:
            self._log.add(arrived, lost, drops["reason"])
        if self._window_ns is not None:
            self._controllers.add(arrivals["destination"], arrived.delays_ns, drops)

    def _close_window(self, length_ns: int) -> None:
        self.check()
        self._links.close_window(self._until_ns, length_ns)
        self._controllers.close_window(self._until_ns, self._age.measured_ns)
        self._windows += 1

    def _flush(self) -> None:
        """Keep the tables that grow abreast of the grid's, whoever is killed."""
        self._settle()
        self._flushed_ns = self._until_ns
        if self._log is not None:
            self._log.flush()
        if self._window_ns is not None:
            self._links.flush()
            self._controllers.flush()

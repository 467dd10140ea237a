"""The network as a participant of the federation: frames in, deliveries out, once an interval."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.cosim.interfaces import DELIVERY, NETWORK, Clock, DeliveryBundle, FrameBundle
from tieline.errors import CosimError, TimeContractBroken
from tieline.network.engine import Engine, Outcome
from tieline.network.ideal import ConstantDelay
from tieline.network.ns3 import Ns3Engine
from tieline.network.packet import PacketEngine
from tieline.network.results import PacketLog, write_delays, write_flows, write_links
from tieline.network.settings import PACKET_ENGINES, NetworkSettings
from tieline.network.spec import FRAME_BYTES, NetworkSpec, least_delay_ns
from tieline.network.stats import FlowStatistics
from tieline.network.topology import network_spec
from tieline.units import NS_PER_S


def open_participant(run: dict[str, Any], folder: Path) -> "NetworkParticipant":
    """Return the network of a run file's content, whose results go to `folder`.

    Raises:
        InputError: the topology is faulty, a setting that the engine needs is missing, or ns-3 is
            not installed or cannot carry the network.
    """
    stated = run["network"]
    settings = NetworkSettings.model_validate({**stated, "topology": stated["topology"] or "case"})
    topology = Path(settings.topology) if settings.engine in PACKET_ENGINES else None
    spec = network_spec(settings, topology, run["sources"], run["destinations"])
    engine = _engine(settings, spec, run["seed"])
    return NetworkParticipant(Clock(**run["clock"]), spec, engine, folder, settings.record_packets)


def _engine(settings: NetworkSettings, spec: NetworkSpec, seed: int) -> Engine:
    if settings.engine == "packet":
        return PacketEngine(spec, seed)
    if settings.engine == "ns3":
        return Ns3Engine(spec, seed)
    return ConstantDelay(len(spec.destinations), spec.lookahead_ns)


class NetworkParticipant:
    """Carries each frame's bytes to every controller and keeps the statistics.

    Args:
        clock: the instants at which frames are measured.
        spec: sources, destinations and flows.
        engine: what carries the packets.
        folder: where the results go.
        record_packets: whether packets.parquet is written.
    """

    name = NETWORK

    def __init__(
        self, clock: Clock, spec: NetworkSpec, engine: Engine, folder: Path, record_packets: bool
    ) -> None:
        self._clock = clock
        self._spec = spec
        self._engine = engine
        self._folder = folder
        flow_of = np.arange(len(spec.flows)).reshape(len(spec.sources), len(spec.destinations))
        least_ns = [least_delay_ns(spec, flow) for flow in spec.flows]
        self._statistics = FlowStatistics(np.array(least_ns, dtype=np.int64), flow_of)
        self._log = PacketLog(folder / "packets.parquet", flow_of) if record_packets else None
        self._frames = _FrameStore(len(spec.destinations))
        self._until_ns = 0

    def start(self) -> list[bytes]:
        """Return the deliveries of the first intervals, in which no frame can matter."""
        return [self._carry(k) for k in range(self._clock.lead)]

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the deliveries of interval k + lead, given the frames measured at t_k.

        Raises:
            TimeContractBroken: the frames were measured at another instant.
            CosimError: the message is no frame bundle, it does not have one frame of the right
                size for each source (or none at all), it comes too late for its frames to enter
                the network in time, or packets are not accounted for.
        """
        bundle = FrameBundle.from_bytes(received)
        self._check(k, bundle)
        sources = np.arange(len(bundle.payloads))
        if len(sources):
            self._engine.send(bundle.measured_ns, sources, k, bundle.payloads)
            self._statistics.add_sent(sources)
            self._frames.keep(k, bundle.payloads)
        return self._carry(k + self._clock.lead)

    def finish(self) -> None:
        """Write the tables and close the engine."""
        self._write()
        self._engine.close()

    def abort(self, reason: str) -> None:
        """Write the tables as far as the run came."""
        self._write()

    def _carry(self, k: int) -> bytes:
        """Run the network over [t_k, t_k+1] and return its deliveries; nothing after the end."""
        if k >= self._clock.intervals:
            return b""
        self._until_ns = self._clock.at_ns(k + 1)
        outcome = self._engine.run_until(self._until_ns)
        self._record(outcome)
        return self._bundle(outcome).to_bytes()

    def _check(self, k: int, bundle: FrameBundle) -> None:
        expected_ns = self._clock.at_ns(k)
        if bundle.measured_ns != expected_ns:
            raise TimeContractBroken(
                f"interval {k} needs the frames of {expected_ns} ns (got {bundle.measured_ns} ns)"
            )
        whole = (len(self._spec.sources), FRAME_BYTES)
        if len(bundle.payloads) and bundle.payloads.shape != whole:
            count, size = bundle.payloads.shape
            raise CosimError(
                f"interval {k} needs {whole[0]} frames of {whole[1]} bytes, or none "
                f"(got {count} of {size})"
            )

    def _record(self, outcome: Outcome) -> None:
        measured_ns = self._measured_ns(outcome.arrivals)
        self._statistics.add(outcome, measured_ns)
        if self._log is not None:
            self._log.add(outcome, measured_ns, self._measured_ns(outcome.drops))

    def _measured_ns(self, records: NDArray[np.void]) -> NDArray[np.int64]:
        return records["sequence"].astype(np.int64) * NS_PER_S // self._clock.rate_hz

    def _bundle(self, outcome: Outcome) -> DeliveryBundle:
        payloads, rows = self._frames.take(outcome)
        records = np.empty(len(outcome.arrivals), DELIVERY)
        for field in outcome.arrivals.dtype.names or ():
            records[field] = outcome.arrivals[field]
        records["payload"] = rows
        return DeliveryBundle(self._until_ns, records, payloads)

    def _write(self) -> None:
        write_flows(self._folder / "flows.parquet", self._spec, self._statistics)
        write_links(self._folder / "links.parquet", self._engine.links(), self._until_ns)
        write_delays(self._folder / "delays.parquet", self._statistics)
        if self._log is not None:
            self._log.close()


class _FrameStore:
    """The bytes of the frames that some packet still carries, by sequence number."""

    def __init__(self, destinations: int) -> None:
        self._destinations = destinations
        self._payloads: dict[int, NDArray[np.uint8]] = {}
        self._under_way: dict[int, int] = {}

    def keep(self, sequence: int, payloads: NDArray[np.uint8]) -> None:
        """Keep the frames of one instant, one packet to each destination."""
        self._payloads[sequence] = payloads
        self._under_way[sequence] = len(payloads) * self._destinations

    def take(self, outcome: Outcome) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        """Return the table of payloads that arrived, each once, and the row of each arrival."""
        sequences = outcome.arrivals["sequence"].astype(np.int64)
        parts = [np.empty((0, FRAME_BYTES), np.uint8)]
        rows = np.empty(len(sequences), np.int64)
        first = 0
        for sequence, _ in self._counted(sequences):
            payloads = self._payloads[sequence]
            is_own = sequences == sequence
            sources = outcome.arrivals["source"][is_own]
            arrived = np.bincount(sources, minlength=len(payloads)) > 0
            rows[is_own] = first + np.cumsum(arrived)[sources] - 1
            parts.append(payloads[arrived])
            first += len(parts[-1])
        self._forget(np.concatenate([sequences, outcome.drops["sequence"]]))
        return np.concatenate(parts), rows

    def _forget(self, ended: NDArray[np.int64]) -> None:
        """Let go of the frames whose last packet has ended."""
        for sequence, count in self._counted(ended):
            self._under_way[sequence] -= count
            if self._under_way[sequence] == 0:
                del self._payloads[sequence], self._under_way[sequence]

    def _counted(self, sequences: NDArray[np.int64]) -> list[tuple[int, int]]:
        """Return each sequence number that occurs and how often, in ascending order."""
        base = next(iter(self._payloads), 0)
        counts = np.bincount(sequences - base)
        return [(base + int(place), int(counts[place])) for place in np.flatnonzero(counts)]

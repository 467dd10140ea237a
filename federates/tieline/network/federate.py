"""The network as a participant of the federation: frames in, deliveries out, once an interval."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.cosim.interfaces import DELIVERY, NETWORK, Clock, DeliveryBundle, FrameBundle
from tieline.errors import CosimError, TimeContractBroken
from tieline.network.captures import Captures
from tieline.network.engine import Engine, Outcome, joined
from tieline.network.linkless import open_without_links
from tieline.network.ns3 import Ns3Engine
from tieline.network.packet import PacketEngine
from tieline.network.recorder import Recorder
from tieline.network.settings import PACKET_ENGINES, NetworkSettings
from tieline.network.spec import FRAME_BYTES, NetworkSpec
from tieline.network.topology import network_spec
from tieline.units import seconds_to_ns


def open_participant(run: dict[str, Any], folder: Path) -> "NetworkParticipant":
    """Return the network of a run file's content, whose results go to `folder`.

    Raises:
        InputError: the topology is faulty, a setting that the engine needs is missing, or ns-3 is
            not installed or cannot carry the network.
    """
    stated = run["network"]
    settings = NetworkSettings.model_validate({**stated, "topology": stated["topology"] or "case"})
    sites = (run["sources"], run["destinations"])
    topology = Path(settings.topology) if settings.engine in PACKET_ENGINES else None
    spec = network_spec(settings, topology, *sites)
    engine: Engine
    if settings.engine == "packet":
        engine = PacketEngine(spec, run["seed"])
    elif settings.engine == "ns3":
        engine = Ns3Engine(spec, run["seed"])
    else:
        engine = open_without_links(settings, spec, *sites, run["seed"])
    clock = Clock(**run["clock"])
    window_s = settings.series_window
    window_ns = None if window_s is None else seconds_to_ns(window_s)
    captures = None
    if isinstance(engine, PacketEngine):
        captures = Captures(folder, spec, engine, round(run["frequency_hz"]), clock.rate_hz)
    recorder = Recorder(folder, spec, engine, clock.rate_hz, window_ns, settings.record_packets)
    return NetworkParticipant(clock, spec, engine, recorder, captures)


class NetworkParticipant:
    """Carries each frame's bytes to every controller and keeps the statistics.

    Args:
        clock: the instants at which frames are measured.
        spec: sources, destinations and flows.
        engine: what carries the packets.
        recorder: keeps the statistics of what became of them.
        captures: writes what some links carry, or none.
    """

    name = NETWORK

    def __init__(
        self,
        clock: Clock,
        spec: NetworkSpec,
        engine: Engine,
        recorder: Recorder,
        captures: Captures | None = None,
    ) -> None:
        self._clock = clock
        self._spec = spec
        self._engine = engine
        self._recorder = recorder
        self._captures = captures
        self._frames = _FrameStore(len(spec.destinations))
        self._next = 0

    def start(self) -> list[bytes]:
        """Return the deliveries of the first intervals, in which no frame can matter."""
        return [self._carry(k) for k in range(self._clock.lead)]

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the deliveries of interval k + lead, given the frames measured at t_k.

        Raises:
            TimeContractBroken: the frames were measured at another instant, or an interval is left
                out or comes again.
            CosimError: the message is no frame bundle, it does not have one frame of the right
                size for each source (or none at all), it comes too late for its frames to enter
                the network in time, or packets are not accounted for.
        """
        bundle = FrameBundle.from_bytes(received)
        self._check(k, bundle)
        self._next += 1
        sources = np.arange(len(bundle.payloads))
        if len(sources):
            self._engine.send(bundle.measured_ns, sources, k, bundle.payloads)
            self._recorder.add_sent(sources, k)
            self._frames.keep(k, bundle.payloads)
        return self._carry(k + self._clock.lead)

    def finish(self) -> None:
        """Write the tables.

        Raises:
            CosimError: packets are not all accounted for.
        """
        self._recorder.check()
        self._write()

    def abort(self, reason: str) -> None:
        """Write the tables as far as the run came."""
        self._write()

    def _write(self) -> None:
        self._recorder.write()
        if self._captures is not None:
            self._captures.close()
        self._engine.close()

    def _carry(self, k: int) -> bytes:
        """Run the network over [t_k, t_k+1] and return its deliveries; nothing after the end."""
        if k >= self._clock.intervals:
            return b""
        until_ns = self._clock.at_ns(k + 1)
        outcomes = []
        for stop_ns in self._recorder.stops(until_ns):
            outcomes.append(self._engine.run_until(stop_ns))
            self._recorder.add(outcomes[-1], stop_ns)
        if self._captures is not None:
            self._captures.add(until_ns, self._frames.payloads_of)
        return self._bundle(joined(outcomes), until_ns).to_bytes()

    def _check(self, k: int, bundle: FrameBundle) -> None:
        if k != self._next:
            raise TimeContractBroken(
                f"{NETWORK}: the frames of interval {k} came for interval {self._next}"
            )
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

    def _bundle(self, outcome: Outcome, until_ns: int) -> DeliveryBundle:
        payloads, rows = self._frames.take(outcome)
        records = np.empty(len(outcome.arrivals), DELIVERY)
        for field in outcome.arrivals.dtype.names or ():
            records[field] = outcome.arrivals[field]
        records["payload"] = rows
        return DeliveryBundle(until_ns, records, payloads)


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

    def payloads_of(
        self, sources: NDArray[np.int64], sequences: NDArray[np.int64]
    ) -> NDArray[np.uint8]:
        """Return the frames (n, size) of sources and sequence numbers (n,)."""
        frames = np.empty((len(sources), FRAME_BYTES), np.uint8)
        for sequence in np.unique(sequences):
            is_own = sequences == sequence
            frames[is_own] = self._payloads[int(sequence)][sources[is_own]]
        return frames

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

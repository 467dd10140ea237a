"""The network as a participant of the federation: frames in, deliveries out, once a meeting."""

from pathlib import Path
from typing import Any

import numpy as np

from tieline.cosim.interfaces import NETWORK, Clock, DeliveryBundle, FrameBundle
from tieline.errors import CosimError, TimeContractBroken
from tieline.network.captures import Captures
from tieline.network.engine import Engine, Outcome, joined
from tieline.network.frames import FrameStore
from tieline.network.linkless import open_without_links
from tieline.network.ns3 import Ns3Engine
from tieline.network.packet import PacketEngine
from tieline.network.recorder import Recorder
from tieline.network.spec import FRAME_BYTES, NetworkSpec
from tieline.network.stated import stated_network
from tieline.units import seconds_to_ns


def open_participant(run: dict[str, Any], folder: Path) -> "NetworkParticipant":
    """Return the network of a run file's content, whose results go to `folder`.

    Raises:
        InputError: the topology is faulty, a setting that the engine needs is missing, or ns-3 is
            not installed or cannot carry the network.
    """
    settings, spec = stated_network(run)
    sites = (run["sources"], run["destinations"])
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
        self._frames = FrameStore(len(spec.sources), len(spec.destinations))
        self._next = 0
        self._carried = 0

    def start(self) -> list[bytes]:
        """Return the deliveries of the first stride where no frame can matter in it."""
        return [self._carry()] if self._clock.lead else []

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the deliveries of the next stride, given the frames measured up to t_k.

        Raises:
            TimeContractBroken: the frames were measured at other instants than those since the
                last meeting.
            CosimError: the message is no frame bundle, it does not have one frame of the right
                size for each source (or none at all), it comes too late for its frames to enter
                the network in time, or packets are not accounted for.
        """
        bundles = FrameBundle.several_from_bytes(received)
        if k - self._next + 1 != len(bundles):
            raise TimeContractBroken(
                f"{NETWORK}: the frames of {len(bundles)} instants came for the intervals from "
                f"{self._next} to {k}"
            )
        for number, bundle in enumerate(bundles, self._next):
            self._take(number, bundle)
        self._next = k + 1
        return self._carry()

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

    def _take(self, k: int, bundle: FrameBundle) -> None:
        """Hand the frames measured at t_k to the network; those of the very end reach nobody."""
        self._check(k, bundle)
        sources = np.arange(len(bundle.payloads))
        if len(sources) and k < self._clock.intervals:
            self._engine.send(bundle.measured_ns, sources, k, bundle.payloads)
            self._recorder.add_sent(sources, k)
            self._frames.keep(k, bundle.payloads)

    def _carry(self) -> bytes:
        """Run the network over one more stride and return its deliveries; nothing after the end."""
        if self._carried == self._clock.intervals:
            return b""
        self._carried = self._clock.next_meeting(self._carried)
        until_ns = self._clock.at_ns(self._carried)
        outcomes = []
        for stop_ns in self._recorder.stops(until_ns):
            outcomes.append(self._engine.run_until(stop_ns))
            self._recorder.add(outcomes[-1], stop_ns)
        if self._captures is not None:
            self._captures.add(until_ns, self._frames.payloads_of)
        return self._bundle(joined(outcomes), until_ns).to_bytes()

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

    def _bundle(self, outcome: Outcome, until_ns: int) -> DeliveryBundle:
        payloads, deliveries = self._frames.take(outcome)
        return DeliveryBundle(until_ns, deliveries, payloads)

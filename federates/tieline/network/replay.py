"""Carries the frames of a run again, without the grid, to see what becomes of one of them.

No engine looks into a frame, so the instants of measurement are all that the network needs.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tieline.cosim.interfaces import Clock
from tieline.errors import InputError
from tieline.network.empirical import EmpiricalDelay
from tieline.network.engine import DELIVERED, Engine, Outcome
from tieline.network.fate import Draw, Fate
from tieline.network.linkless import open_without_links
from tieline.network.packet.tracing import TracingEngine
from tieline.network.settings import PACKET_ENGINES
from tieline.network.spec import NetworkSpec
from tieline.network.stated import stated_network


def replay(run: Mapping[str, Any], source: int, destination: int, sequence: int) -> Fate:
    """Return what became of the packet of one frame from a PMU to a controller.

    The engine `ns3` is replayed by the packet engine, which gives every packet the same fate.

    Args:
        run: the content of the run file.
        source, destination: their numbers.
        sequence: the number of the frame.

    Raises:
        InputError: the engine cannot be repeated, or its input is missing.
    """
    settings, spec = stated_network(run)
    flow = source * len(spec.destinations) + destination
    clock = Clock(**run["clock"])
    if settings.engine in PACKET_ENGINES:
        watched = TracingEngine(replace(spec, taps=()), run["seed"], flow, sequence)
        _carry(watched, spec, clock, sequence, lambda _: watched.is_over)
        return _by_the_end(watched.fate, clock)
    if settings.engine == "helics-filters" and settings.loss:
        raise InputError(
            "network.engine helics-filters cannot be repeated with network.loss above 0: HELICS's"
            " random_drop takes no seed"
        )
    sites = (run["sources"], run["destinations"])
    if settings.engine == "helics-filters":
        # Without losses its one delay is all there is to it, and no HELICS is needed for that.
        settings = settings.model_copy(update={"engine": "constant"})
    engine = open_without_links(settings, spec, *sites, run["seed"])
    fate = Fate(
        spec.sources[source].name,
        spec.destinations[destination].name,
        sequence,
        clock.at_ns(sequence),
        transport="no links",
    )
    _carry(engine, spec, clock, sequence, lambda outcome: _sees(outcome, fate, source, destination))
    if isinstance(engine, EmpiricalDelay):
        _note_draws(fate, flow, engine)
    return _by_the_end(fate, clock)


def _by_the_end(fate: Fate, clock: Clock) -> Fate:
    """Return a fate as the run saw it, which ended after its last interval."""
    end_ns = clock.at_ns(clock.intervals)
    if fate.ended_ns is not None and fate.ended_ns > end_ns:
        fate.remark = "it came, but its controller could not use it before the end of the run"
        fate.outcome, fate.ended_ns = None, None
    return fate


def _carry(
    engine: Engine,
    spec: NetworkSpec,
    clock: Clock,
    sequence: int,
    is_over: Callable[[Outcome], bool],
) -> None:
    """Send frame after frame until one has ended, or the run has."""
    sources = np.arange(len(spec.sources))
    for k in range(clock.intervals):
        engine.send(clock.at_ns(k), sources, k)
        outcome = engine.run_until(clock.at_ns(k + 1))
        if k >= sequence and is_over(outcome):
            return


def _sees(outcome: Outcome, fate: Fate, source: int, destination: int) -> bool:
    """Return whether a packet is among those that ended, and note how."""
    for records in (outcome.arrivals, outcome.drops):
        own = records[
            (records["source"] == source)
            & (records["destination"] == destination)
            & (records["sequence"] == fate.sequence)
        ]
        if len(own):
            fate.ended_ns = int(own[0][0])
            is_drop = "reason" in (records.dtype.names or ())
            fate.outcome = int(own[0]["reason"]) if is_drop else DELIVERED
            return True
    return False


def _note_draws(fate: Fate, flow: int, engine: EmpiricalDelay) -> None:
    """Note what was drawn for a packet of a path: each frame takes one number of each stream."""
    number = fate.sequence + 1
    value = None if fate.ended_ns is None else float(fate.ended_ns - fate.measured_ns)
    delay, *loss = engine.streams_of(flow)
    fate.draws = [Draw(delay, number, value), *(Draw(name, number) for name in loss)]

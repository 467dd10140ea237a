"""A run's memory is bounded: what it holds does not follow its length, nor what it cannot carry."""

import gc
import tracemalloc
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from tieline.cosim.interfaces import Clock, Participant
from tieline.cosim.local import run_local
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.grid.federate import open_participant as open_grid
from tieline.network.federate import open_participant as open_network

SETTINGS = (
    "sweep=null",
    "network.mean_delay=null",
    "network.record_packets=true",
    "network.loss=0.01",
    "grid.duration=4 s",
    # Ten times what the link carries, and a connection that never has enough.
    "network.traffic=["
    "{kind: poisson, from: S101, to: S105, rate: 200 Mbit/s, payload: 972},"
    "{kind: greedy, from: S105, to: S101}]",
)
EARLY_S, LATE_S = 2, 4
"""After 2 s delays have had their whole range, which the histograms keep room for."""
RATE_HZ = 60

MOST_BYTES_MORE = 200_000
"""What may be held more after 4 s than after 2 s: caches of small things; any table that were kept
in memory would take more. The test asserts that it is below a tenth of what is stored."""


class Gauge:
    """A grid that notes what its process holds before the strides that end at two instants."""

    def __init__(self, grid: Participant, clock: Clock) -> None:
        self._grid = grid
        self._clock = clock
        self.name = grid.name
        self.held: dict[int, int] = {}

    def start(self) -> list[bytes]:
        return self._grid.start()

    def advance(self, k: int, received: bytes) -> bytes:
        until = self._clock.next_meeting(k)
        if until in (EARLY_S * RATE_HZ, LATE_S * RATE_HZ):
            gc.collect()
            python, _ = tracemalloc.get_traced_memory()
            self.held[until // RATE_HZ] = python + pa.total_allocated_bytes()
        return self._grid.advance(k, received)

    def finish(self) -> None:
        self._grid.finish()

    def abort(self, reason: str) -> None:
        self._grid.abort(reason)


@pytest.fixture(scope="module")
def overloaded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Gauge, Any, Path]:
    """Return what was held, the network and the folder of a run of 4 s with everything recorded."""
    folder = tmp_path_factory.mktemp("overloaded")
    run = dict(prepare(load_experiment("g26_trip", list(SETTINGS))).runs[0].run)
    # Once untraced: to follow what imports and compiled code take would cost a minute.
    open_grid(run, tmp_path_factory.mktemp("before")).abort("")
    open_network(run, tmp_path_factory.mktemp("before")).abort("")
    tracemalloc.start()
    try:
        clock = Clock(**run["clock"])
        gauge, network = Gauge(open_grid(run, folder), clock), open_network(run, folder)
        run_local(gauge, network, clock)
    finally:
        tracemalloc.stop()
    return gauge, network, folder


def test_what_a_run_holds_does_not_follow_its_length(
    overloaded: tuple[Gauge, Any, Path],
) -> None:
    """Otherwise a night's study would end in the arms of the out-of-memory killer."""
    gauge, _, folder = overloaded
    stored = sum(path.stat().st_size for path in folder.glob("*.parquet"))
    grown = gauge.held[LATE_S] - gauge.held[EARLY_S]
    assert grown < MOST_BYTES_MORE < stored / 10


def test_a_network_that_is_given_too_much_drops_it(overloaded: tuple[Gauge, Any, Path]) -> None:
    """Otherwise ten times the traffic would take ten times the memory, and more each second."""
    _, network, _ = overloaded
    links = {(link.origin, link.target): link for link in network._engine.links()}
    busy = links["S101", "S105"]
    assert busy.dropped_queue > 5 * busy.packets
    inside = network._engine._memory.layout.capacity
    # Far below the second's worth of packets that is offered to the link alone.
    assert inside < 25_000

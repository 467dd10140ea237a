"""ns-3 behind the engine protocol, packet by packet against tieline's own engine."""

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from network.builders import busy_ring, chain
from network.ns3_cases import CASES, Fate, fate
from scenarios.study import run
from tieline.errors import InputError
from tieline.network.ns3 import library, limits
from tieline.network.ns3.addresses import addressed
from tieline.network.ns3.build import rate_for_ns3
from tieline.network.packet import PacketEngine
from tieline.network.queues import EarlyDetection, RandomEarlyDetection
from tieline.network.spec import CrossFlow, LinkCut, service_ns
from tieline.network.traffic import Cbr, Greedy

TESTS = Path(__file__).parents[1]
RED = RandomEarlyDetection(10, EarlyDetection(3.0, 8.0, 0.1, 4))


def with_ns3(test: Any) -> Any:
    """Mark a test that simulates with ns-3."""
    reason = "the ns-3 wheel is not installed: pip install 'tieline[ns3]'"
    return pytest.mark.ns3(pytest.mark.skipif(find_spec("ns3") is None, reason=reason)(test))


@pytest.fixture(scope="module")
def by_ns3(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Fate], dict[str, str]]:
    """Return what ns-3 makes of every case, and what it says to faults, from one process."""
    path = tmp_path_factory.mktemp("ns3") / "result"
    script = TESTS / "network" / "ns3_process.py"
    places = [str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])]
    ended = subprocess.run(
        [sys.executable, "-W", "error", str(script), str(path)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(places)},
        capture_output=True,
        text=True,
        check=False,
    )
    # The exit code counts, too: a crash while ns-3 is taken down would end a run as a failure.
    assert ended.returncode == 0, ended.stderr
    found: tuple[dict[str, Fate], dict[str, str]] = pickle.loads(path.read_bytes())
    return found


@with_ns3
@pytest.mark.parametrize("name", CASES)
def test_every_packet_fares_as_in_the_packet_engine(
    name: str, by_ns3: tuple[dict[str, Fate], dict[str, str]]
) -> None:
    """Otherwise one of the two simulators would not simulate what the topology says.

    Arrivals and drops to the nanosecond and in their order, counts, and what each link carried.
    The cases in rounds hold events of the same instant all the way.
    """
    expected = fate(PacketEngine, CASES[name]())
    found = by_ns3[0][name]
    assert found.counts == expected.counts
    assert found.links == expected.links
    assert found.counters == expected.counters
    assert found.drops == expected.drops
    assert found.arrivals == expected.arrivals
    assert len(found.arrivals) > 0


@with_ns3
def test_the_cases_drop_at_queues_and_on_links(
    by_ns3: tuple[dict[str, Fate], dict[str, str]],
) -> None:
    """Otherwise equality would say nothing of drops."""
    counts = [found.counts for found in by_ns3[0].values()]
    assert sum(count.dropped_queue for count in counts) > 1000
    assert sum(count.dropped_loss for count in counts) > 1000
    assert sum(count.in_flight for count in counts) > 0


@with_ns3
def test_a_byte_that_changes_on_the_way_is_noticed(
    by_ns3: tuple[dict[str, Fate], dict[str, str]],
) -> None:
    """Otherwise the frames handed over need not be those that travelled."""
    said = by_ns3[1]["damage"]
    assert said == (
        "ns-3 at 1000000000 ns: frame 0 of flow 0 came with other bytes, or to another controller"
    )


@with_ns3
def test_a_second_network_in_one_process_is_refused(
    by_ns3: tuple[dict[str, Fate], dict[str, str]],
) -> None:
    """Otherwise two networks would share ns-3's one clock."""
    assert "one network at a time" in by_ns3[1]["second"]


@with_ns3
@pytest.mark.helics
@pytest.mark.slow
def test_a_federation_with_ns3_gives_the_bits_of_one_with_the_packet_engine(
    tmp_path: Path,
) -> None:
    """Otherwise the results of the shipped network would rest on tieline's own engine alone.

    The trip of G26 on the miniWECC's topology with its cross traffic, over zmq against one process
    without HELICS: every table, the grid's trajectories among them.
    """
    ways = {"packet": "local", "ns3": "zmq"}
    tables = [
        run(
            "g26_trip_smoke",
            tmp_path / engine,
            f"network.engine={engine}",
            f"federation.core={core}",
            "federation.hang_timeout=60 s",
            "network.record_packets=true",
        ).manifest["tables"]
        for engine, core in ways.items()
    ]
    assert {"grid.parquet", "flows.parquet", "links.parquet", "packets.parquet"} <= set(tables[0])
    assert tables[0] == tables[1]


def test_without_its_wheel_the_engine_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a user would meet an import error of a package that nobody named."""
    monkeypatch.setattr(library, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'tieline\[ns3\]'"):
        limits.check_carried(chain([(10**7, 0)]))


def test_what_ns3_has_not_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the two engines would simulate different networks under one name."""
    monkeypatch.setattr(limits, "check_installed", lambda: None)
    with pytest.raises(InputError) as refused:
        limits.check_carried(busy_ring())
    assert len(refused.value.findings) == 3
    assert refused.value.findings[0] == (
        "network.engine ns3 has no jitter of a link, and a-b has it: use network.engine packet"
    )


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"is_half_duplex": True}, "has no is_half_duplex of a link, and n0-n1 has it"),
        ({"queue": RED}, "drop-tail queues alone, and link n0-n1 has a RandomEarlyDetection"),
        ({"mtu_bytes": 500}, "those of big have 1028 bytes where the MTU is 500"),
    ],
)
def test_a_link_that_ns3_has_not_is_refused(
    changed: dict[str, Any], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise the link would silently be another one."""
    monkeypatch.setattr(limits, "check_installed", lambda: None)
    spec = chain([(10**7, 0)])
    big = CrossFlow("big", Cbr(10**6, 1000), ("n0", "n1"))
    spec = replace(spec, cross_flows=(big,), links=(replace(spec.links[0], **changed),))
    with pytest.raises(InputError, match=text):
        limits.check_carried(spec)


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"transport": "multicast"}, "no transport of a network"),
        ({"changes": (LinkCut(10**9, 0),)}, "no changes of a network"),
        ({"taps": (0,)}, "no taps of a network"),
        (
            {"cross_flows": (CrossFlow("bulk", Greedy(1000, 64), ("n0", "n1")),)},
            "no traffic that waits for answers, and bulk is Greedy",
        ),
    ],
)
def test_a_network_that_ns3_has_not_is_refused(
    changed: dict[str, Any], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise an event, or a transport, of the topology would silently not happen."""
    monkeypatch.setattr(limits, "check_installed", lambda: None)
    with pytest.raises(InputError, match=text):
        limits.check_carried(replace(chain([(10**7, 0)]), **changed))


def test_a_route_longer_than_the_time_to_live_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise IP would drop the packets on the way."""
    monkeypatch.setattr(limits, "check_installed", lambda: None)
    limits.check_carried(chain([(10**7, 0)] * limits.MOST_HOPS))
    with pytest.raises(InputError, match="at most 254 links"):
        limits.check_carried(chain([(10**7, 0)] * (limits.MOST_HOPS + 1)))


def test_a_rate_is_chosen_at_which_ns3_rounds_as_the_specification_does() -> None:
    """Otherwise a queue behind such a link would drift by a nanosecond a packet."""
    [link] = chain([(128_000_000, 0)], overhead_bytes=9).links

    def rounding_down(rate_bps: int, size_bytes: int) -> int:
        return (8 * size_bytes * 10**9 - 1) // rate_bps

    # 71 bytes take 4437.5 ns, and one bit a second less makes them 4437.500035 ns.
    assert service_ns(link, 34) == 4438
    assert rate_for_ns3(link, {34}, lambda rate, size: 4437 + (rate < 128_000_000)) == 127_999_999
    with pytest.raises(
        InputError, match=r"cannot serialise packets of 71 to 71 bytes .*link n0-n1"
    ):
        rate_for_ns3(link, {34}, rounding_down)


def test_flows_share_an_address_only_where_their_routes_agree() -> None:
    """Otherwise IP, which forwards by destination, would lead one of them along another's route."""
    spec = CASES["two ways"]().spec
    addresses, numbers = addressed(spec)
    assert numbers == [0, 1, 0, 2]
    assert [address.node for address in addresses] == ["d", "d", "a"]
    for flow, number in zip((*spec.flows, *spec.cross_flows), numbers, strict=True):
        ports = [addresses[number].next_port[node] for node in flow.route[:-1]]
        assert ports == [port for port, _ in spec.hops(flow.route)]

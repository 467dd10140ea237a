"""Topology files: what they say is what the network is, and what is wrong is said with its line."""

from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.network.jitter import GammaJitter, NormalJitter, UniformJitter
from tieline.network.losses import Bernoulli
from tieline.network.queues import DropTail
from tieline.network.settings import NetworkSettings
from tieline.network.spec import Link, NetworkSpec
from tieline.network.topology import Networks, network_spec, read_topology

SOURCES = [{"name": "pmu00", "bus": 2}, {"name": "pmu01", "bus": 4}]
DESTINATIONS = [
    {"name": "ctl00", "unit": "G1", "bus": 1},
    {"name": "ctl01", "unit": "G2", "bus": 5},
]

GOOD = """\
link_defaults: {rate: 10 Mbit/s, queue: 50, overhead: 9}
pmu: {processing: 60 ms, jitter: {distribution: uniform, low: 1 ms, high: 3 ms}}
controller: {processing: 5 ms}
nodes:
  north: {buses: [1, 2], x: 0, y: 10}
  middle:
  south: {buses: [4, 5]}
links:
  - {a: north, b: middle, propagation: 2 ms}
  - a: south
    b: middle
    propagation: 0.25 ms
    rate: 512 kbit/s
    queue: 7
    loss: 0.01
    overhead: 0
    jitter: {distribution: gamma, mean: 1 ms, deviation: 2 ms}
cross_traffic:
  - {kind: poisson, from: north, to: south, rate: 100 kbit/s, payload: 222}
"""


def read(folder: Path, text: str = GOOD, **settings: object) -> NetworkSpec:
    """Return the network of a file with this text."""
    path = folder / "network.yaml"
    path.write_text(text, encoding="utf-8")
    return read_topology(path, SOURCES, DESTINATIONS, NetworkSettings(**settings))


def findings(folder: Path, text: str, **settings: object) -> list[str]:
    """Return what is refused, without the file's folder."""
    with pytest.raises(InputError) as caught:
        read(folder, text, **settings)
    return [finding.removeprefix(f"{folder}/") for finding in caught.value.findings]


def test_a_file_says_what_the_network_is(tmp_path):
    """Otherwise an experiment would run on another network than the one written down."""
    spec = read(tmp_path)
    assert spec.links == (
        Link("north", "middle", 10_000_000, 2_000_000, DropTail(50), overhead_bytes=9),
        Link(
            "south",
            "middle",
            512_000,
            250_000,
            DropTail(7),
            Bernoulli(0.01),
            GammaJitter(1_000_000, 2_000_000),
        ),
    )
    assert [(node.name, node.buses, node.x) for node in spec.nodes] == [
        ("north", (1, 2), 0.0),
        ("middle", (), None),
        ("south", (4, 5), None),
    ]
    pmu, controller = spec.sources[1], spec.destinations[0]
    assert (pmu.name, pmu.bus, pmu.node, pmu.processing_ns) == ("pmu01", 4, "south", 60_000_000)
    assert pmu.jitter == UniformJitter(1_000_000, 3_000_000)
    assert (controller.unit, controller.node, controller.processing_ns) == (
        "G1",
        "north",
        5_000_000,
    )
    assert [flow.route for flow in spec.flows] == [
        ("north",),
        ("north", "middle", "south"),
        ("south", "middle", "north"),
        ("south",),
    ]
    (cross,) = spec.cross_flows
    # 250 bytes of payload, UDP and IPv4 at 100 kbit/s.
    assert (cross.route, cross.traffic.gap_ns) == (("north", "middle", "south"), 20_000_000)


def test_settings_override_the_file(tmp_path):
    """Otherwise a sweep over loss or load would repeat one experiment."""
    spec = read(tmp_path, loss=0.2, cross_traffic=2.0)
    assert {link.loss for link in spec.links} == {Bernoulli(0.2)}
    assert spec.cross_flows[0].traffic.gap_ns == 10_000_000
    assert read(tmp_path, loss=0.0).links[1].loss is None
    assert read(tmp_path, cross_traffic=0.0).cross_flows == ()


def test_the_unloaded_mean_by_hand(tmp_path):
    """Otherwise network.mean_delay would count from a wrong figure.

    Two flows stay in their station: 60 + 2 + 5 = 67 ms. Two cross both links: 71 bytes at
    10 Mbit/s (56.8 us) and 62 at 512 kbit/s (968.75 us), 2.25 ms of fibre, 1 ms of mean jitter.
    """
    across_ns = 67e6 + 56_800 + 968_750 + 2_250_000 + 1_000_000
    assert read(tmp_path).mean_unloaded_delay_ns == pytest.approx((67e6 + across_ns) / 2, abs=1)


@pytest.mark.parametrize("target", [0.1, 0.25, 1.25])
def test_mean_delay_is_reached_by_longer_processing_at_every_pmu(tmp_path, target):
    """Otherwise a study of longer delays would change the shape of their distribution, too."""
    base, spec = read(tmp_path), read(tmp_path, mean_delay=target)
    # The extra time is rounded to a whole nanosecond.
    assert spec.mean_unloaded_delay_ns == pytest.approx(target * 1e9, abs=1)
    extra = {
        new.processing_ns - old.processing_ns
        for new, old in zip(spec.sources, base.sources, strict=True)
    }
    assert len(extra) == 1
    assert (spec.links, spec.flows, spec.destinations) == (
        base.links,
        base.flows,
        base.destinations,
    )


def test_a_mean_delay_below_the_base_is_refused_with_the_base(tmp_path):
    """Otherwise a run labelled 50 ms would have 69."""
    (finding,) = findings(tmp_path, GOOD, mean_delay=0.05)
    assert finding.startswith("network.mean_delay must be at least 0.069138 s, the mean delay of")
    assert finding.endswith("(got 0.05 s)")


def test_every_fault_of_a_file_is_named_at_once_with_its_line(tmp_path):
    """Otherwise a user would repair a file in as many rounds as it has faults."""
    text = """\
link_defaults: {rate: 10 Mbit/s, queu: 50}
pmu: {processing: 5 parsecs}
controler: {processing: 5 ms}
nodes:
  north: {buses: [1, 2]}
  middle: {buses: [1]}
  south: {buses: [5, x]}
links:
  - {a: north, b: midle, propagation: 2 ms, queue: 5}
  - {a: south, b: middle, propagation: 1 ms, queue: 0}
  - {a: south, b: middle, propagation: 1 ms, queue: 5, latency: 4}
  - {a: north, b: south, propagation: 1 ms, queue: 5, rate: 0 Mbit/s, loss: 1}
  - {a: north, b: middle}
cross_traffic:
  - {kind: poison, from: north, to: south, rate: 1 Mbit/s, payload: 100}
  - {kind: cbr, from: north, to: soth, rate: 1 Mbit/s, payload: 100}
"""
    assert findings(tmp_path, text) == [
        "network.yaml:1: unknown key 'queu' (did you mean 'queue'?)",
        "network.yaml:2: pmu.processing must be a time in one of s, ms, us, ns, min "
        "(got '5 parsecs')",
        "network.yaml:3: unknown key 'controler' (did you mean 'controller'?)",
        "network.yaml:4: no node holds bus 4 of PMU pmu01",
        "network.yaml:4: no node holds bus 5 of controller ctl01",
        "network.yaml:6: bus 1 is in node north and again in node middle",
        "network.yaml:7: nodes.south.buses.1 must be a valid integer (got 'x')",
        "network.yaml:9: unknown node 'midle' (did you mean 'middle'?)",
        "network.yaml:10: links.1.queue must be greater than or equal to 1 (got 0)",
        "network.yaml:11: unknown key 'latency' "
        "(allowed: rate, queue, loss, jitter, overhead, framing, mpls_labels, duplex, mtu, cost, "
        "a, b, propagation)",
        "network.yaml:12: links.3.rate must be greater than or equal to 1 (got '0 Mbit/s')",
        "network.yaml:12: links.3.loss must be less than 1 (got 1)",
        "network.yaml:13: links.4 lacks 'propagation'",
        "network.yaml:15: unknown kind 'poison' (did you mean 'poisson'?)",
        "network.yaml:16: unknown node 'soth' (did you mean 'south'?)",
    ]


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("a: south\n", "a: middle\n", "10: links.1 must join two nodes (got 'middle' twice)"),
        ("b: middle\n", "b: north\n", None),
        ("rate: 512 kbit/s", "rate: 512 kbps", "13: links.1.rate must be a rate in one of"),
        ("loss: 0.01", "loss: -0.1", "15: links.1.loss must be greater than or equal to 0"),
        ("loss: 0.01", "loss: .nan", "15: links.1.loss must be a finite number (got nan)"),
        ("queue: 7", "queue: 7.5", "14: links.1.queue must be a valid integer (got 7.5)"),
        (
            "gamma",
            "gama",
            "17: links.1.jitter must have a 'distribution' of constant, uniform, normal",
        ),
        ("deviation: 2 ms", "deviation: 0", "17: links.1.jitter.deviation must be greater than"),
        ("deviation", "deviatio", "17: unknown key 'deviatio' (did you mean 'deviation'?)"),
        ("low: 1 ms", "low: 4 ms", "2: pmu.jitter 'low' must not exceed 'high'"),
        ("rate: 10 Mbit/s, ", "", "9: link north-middle has no 'rate'"),
        ("links:", "linkz:", "1: 'links' is missing"),
        ("  south: {buses: [4, 5]}", "  south: [4, 5]", "7: nodes.south must hold keys and values"),
        ("  middle:", "  5:", "6: a node's name must be text (got 5)"),
        ("to: south", "to: north", "19: cross_traffic.0 must join two nodes (got 'north' twice)"),
        ("payload: 222", "payload: 0", "19: cross_traffic.0.payload must be greater than"),
    ],
)
def test_each_fault_is_refused(tmp_path, old, new, finding):
    """Otherwise a slip would run as another network."""
    assert GOOD.count(old) == 1 or old == "queue: 7"
    text = GOOD.replace(old, new)
    if finding is None:
        read(tmp_path, text)
        return
    found = findings(tmp_path, text)
    assert any(line.startswith(f"network.yaml:{finding}") for line in found), found


def test_parallel_links_are_refused_whichever_way_they_are_written(tmp_path):
    """Otherwise one of two links would silently be left out of every route."""
    text = GOOD.replace(
        "cross_traffic", "  - {a: middle, b: north, propagation: 1 s}\ncross_traffic"
    )
    assert findings(tmp_path, text) == [
        "network.yaml:18: duplicate link middle-north (first on line 9)"
    ]


def test_a_disconnected_network_names_who_is_cut_off(tmp_path):
    """Otherwise a controller would wait for ever, and the run would not say why."""
    text = GOOD.replace("links:\n", "  isle:\nlinks:\n").replace("b: middle\n", "b: isle\n")
    assert findings(tmp_path, text) == [
        "network.yaml:6: disconnected network: no link joins middle, north to the rest; "
        "unreachable: pmu00, ctl00"
    ]


@pytest.mark.parametrize("text", ["", "[1, 2]", "just words", "5"])
def test_a_file_of_something_else_is_refused(tmp_path, text):
    """Otherwise a wrong path would end in a traceback."""
    (finding,) = findings(tmp_path, text)
    assert finding.startswith("network.yaml:1: the file must hold keys and values (got")


def test_the_order_of_a_file_changes_nothing_but_port_numbers(tmp_path):
    """Otherwise sorting a file would change the routes."""
    head, rest = GOOD.split("links:\n")
    links, cross = rest.split("cross_traffic")
    first, second = links.split("\n", 1)
    swapped = f"{head}links:\n{second}{first}\ncross_traffic{cross}"
    assert read(tmp_path, swapped).flows == read(tmp_path).flows


def test_checking_alone_returns_nothing_and_refuses_the_same(tmp_path):
    """Otherwise a run would start that its network then refuses."""
    path = tmp_path / "network.yaml"
    path.write_text(GOOD, encoding="utf-8")
    network_spec(NetworkSettings(), path, SOURCES, DESTINATIONS)
    path.write_text(GOOD.replace("queue: 7", "queue: 0"), encoding="utf-8")
    with pytest.raises(InputError, match=r"network\.yaml:14"):
        network_spec(NetworkSettings(), path, SOURCES, DESTINATIONS)


def test_networks_of_one_file_are_those_that_are_read_one_by_one(tmp_path):
    """Otherwise the points of a sweep would run on other networks than the same runs alone."""
    path = tmp_path / "network.yaml"
    path.write_text(GOOD, encoding="utf-8")
    networks = Networks()
    for changes in ({}, {"mean_delay": 0.2}, {"loss": 0.1, "mean_delay": 0.2}, {"mean_delay": 0.3}):
        settings = NetworkSettings(**changes)
        alone = network_spec(settings, path, SOURCES, DESTINATIONS)
        assert networks.spec(settings, path, SOURCES, DESTINATIONS) == alone
    with pytest.raises(InputError, match=r"mean_delay must be at least 0\.069138 s"):
        networks.spec(NetworkSettings(mean_delay=0.05), path, SOURCES, DESTINATIONS)


def test_a_normal_jitter_is_read(tmp_path):
    """Otherwise one of the three distributions could not be used."""
    text = GOOD.replace("gamma", "normal")
    assert read(tmp_path, text).links[1].jitter == NormalJitter(1_000_000, 2_000_000)

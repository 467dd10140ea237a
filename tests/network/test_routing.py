"""Routes: least delay, and one result whatever the order in which a network is written down."""

import random
from collections import Counter
from dataclasses import replace

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from network.test_topology_file import findings, read
from tieline.network.queues import DropTail
from tieline.network.routing import Router, Routing, routes_from
from tieline.network.spec import Link


def link(a: str, b: str, propagation_ns: int = 1_000, rate_bps: int = 10**9) -> Link:
    """Return a link that differs in what routing looks at."""
    return Link(a, b, rate_bps, propagation_ns, DropTail(10))


def test_the_fastest_route_wins_over_the_one_of_fewer_links():
    """Otherwise packets would cross a satellite because it is one hop."""
    links = [link("a", "d", 9_000), link("a", "b"), link("b", "c"), link("c", "d")]
    assert routes_from(["a"], "abcd", links)["a"]["d"] == ("a", "b", "c", "d")


def test_serialisation_counts_as_delay():
    """Otherwise a slow link of no length would attract all traffic."""
    links = [link("a", "c", 0, rate_bps=64_000), link("a", "b", 10_000), link("b", "c", 10_000)]
    assert routes_from(["a"], "abc", links)["a"]["c"] == ("a", "b", "c")


def test_of_equally_fast_routes_the_one_of_fewer_links_wins():
    """Otherwise a tie would be broken by chance."""
    # Serialisation is left out with a rate at which 62 bytes take 0 ns.
    fast = 10**13
    links = [
        link("a", "b", 1_000, fast),
        link("b", "d", 1_000, fast),
        link("a", "c", 500, fast),
        link("c", "e", 500, fast),
        link("e", "d", 1_000, fast),
    ]
    assert routes_from(["a"], "abcde", links)["a"]["d"] == ("a", "b", "d")


@given(st.integers(0, 2**32))
def test_the_order_of_nodes_and_links_changes_nothing(seed):
    """Otherwise sorting a topology file would change the results of an experiment.

    A grid of 3 x 3 equal links is full of ties.
    """
    names = [f"{row}{column}" for row in range(3) for column in range(3)]
    links = [link(f"{r}{c}", f"{r}{c + 1}") for r in range(3) for c in range(2)]
    links += [link(f"{r}{c}", f"{r + 1}{c}") for r in range(2) for c in range(3)]
    shuffler = random.Random(seed)
    mixed = [link(x.b, x.a) if shuffler.random() < 0.5 else x for x in links]
    shuffler.shuffle(mixed)
    shuffled = shuffler.sample(names, len(names))
    assert routes_from(shuffled, shuffled, mixed) == routes_from(names, names, links)


def test_a_node_reaches_itself_without_a_link():
    """Otherwise a controller beside its PMU could not be reached."""
    assert routes_from(["a"], "ab", [link("a", "b")])["a"]["a"] == ("a",)


def test_hops_and_costs_are_other_metrics():
    """Otherwise a network could not be routed as its operator does."""
    links = [
        replace(link("a", "d", 9_000), cost=5.0),
        link("a", "b"),
        link("b", "d"),
        replace(link("a", "c", 9_000), cost=0.25),
        replace(link("c", "d", 9_000), cost=0.25),
    ]
    ways = {
        metric: Router(Routing(metric), "abcd", links).route("a", "d")
        for metric in ("delay", "hops", "cost")
    }
    assert ways == {"delay": ("a", "b", "d"), "hops": ("a", "d"), "cost": ("a", "c", "d")}


def fan(ways: int, **more: float) -> list[Link]:
    """Return links from a to z over some middles, all alike."""
    middles = [f"m{i}" for i in range(ways)]
    links = [pair for middle in middles for pair in (link("a", middle), link(middle, "z"))]
    return [replace(each, **more) for each in links]


def test_flows_are_split_over_equal_ways():
    """Otherwise parallel links would stand idle.

    4,000 flows over four ways: a thousand each, within four standard deviations (27).
    """
    links = fan(4)
    router = Router(Routing(is_split=True), {x for y in links for x in (y.a, y.b)}, links)
    counts = Counter(router.route("a", "z", f"flow {number}") for number in range(4_000))
    assert set(counts) == {("a", f"m{i}", "z") for i in range(4)}
    assert all(abs(count - 1_000) < 4 * 27.4 for count in counts.values())


def test_only_ways_of_equal_length_are_taken():
    """Otherwise a flow would take a longer way for the sake of balance."""
    links = [*fan(2), link("a", "far", 1_001), link("far", "z")]
    router = Router(Routing(is_split=True), ["a", "z", "m0", "m1", "far"], links)
    ways = {router.route("a", "z", f"flow {number}") for number in range(100)}
    assert ways == {("a", "m0", "z"), ("a", "m1", "z")}


@given(st.integers(0, 2**32))
def test_the_order_of_links_does_not_move_split_flows(seed):
    """Otherwise sorting a topology file would send flows along other ways."""
    names = [f"{row}{column}" for row in range(3) for column in range(3)]
    links = [link(f"{r}{c}", f"{r}{c + 1}") for r in range(3) for c in range(2)]
    links += [link(f"{r}{c}", f"{r + 1}{c}") for r in range(2) for c in range(3)]
    mixed = [link(x.b, x.a) for x in random.Random(seed).sample(links, len(links))]
    routers = [Router(Routing(is_split=True), names, each) for each in (links, mixed)]
    for flow in range(20):
        first, second = (router.route("00", "22", f"flow {flow}") for router in routers)
        assert first == second
        assert len(first) == 5


def test_split_flows_do_not_go_round_where_links_have_no_length():
    """Otherwise a network of very fast, short links would never be routed."""
    names = ["a", "b", "c", "d"]
    pairs = [(x, y) for x in names for y in names if x < y]
    links = [link(x, y, 0, 10**13) for x, y in pairs]
    router = Router(Routing(is_split=True), names, links)
    ways = {router.route("a", "d", f"flow {number}") for number in range(50)}
    assert ways == {("a", "d")}


def test_links_that_are_down_are_avoided_unless_a_route_is_fixed():
    """Otherwise a failure would change nothing, or a fixed route would move."""
    links = [link("a", "b"), link("a", "c"), link("c", "b")]
    assert Router(Routing(), "abc", links, down=[0]).route("a", "b") == ("a", "c", "b")
    assert Router(Routing(), "abc", links, down=[0, 1]).route("a", "b") is None
    fixed = Routing(fixed={("a", "b"): ("a", "b")})
    assert Router(fixed, "abc", links, down=[0]).route("a", "b") == ("a", "b")


FILE = """\
link_defaults: {rate: 1 Gbit/s, queue: 50}
nodes: {a: {buses: [2, 4]}, b: {buses: [1, 5]}, c: , d: }
links:
  - {a: a, b: b, propagation: 1 ms}
  - {a: a, b: c, propagation: 2 ms}
  - {a: c, b: b, propagation: 2 ms}
  - {a: c, b: d, propagation: 2 ms}
"""


def test_a_route_of_the_file_is_taken(tmp_path):
    """Otherwise a label-switched path could not be written down."""
    text = FILE + "routes: [{from: a, to: b, via: [c]}]\n"
    assert {flow.route for flow in read(tmp_path, text).flows} == {("a", "c", "b")}


def test_faulty_routes_are_refused_with_their_lines(tmp_path):
    """Otherwise packets would go round for ever, or along a link that does not exist."""
    text = (
        FILE
        + """\
routes:
  - {from: a, to: b, via: [c, d, c]}
  - {from: a, to: d}
  - {from: a, to: e}
  - {from: a, to: c, via: [e]}
  - {from: b, to: b}
  - {from: b, to: a}
  - {from: b, to: a, via: [c]}
"""
    )
    assert findings(tmp_path, text) == [
        "network.yaml:9: the route from a to b is a loop: it passes c twice",
        "network.yaml:10: the route from a to d uses a link a-d that there is not",
        "network.yaml:11: unknown node 'e' (allowed: a, b, c, d)",
        "network.yaml:12: the route from a to c uses a link a-e that there is not",
        "network.yaml:13: routes.4 must join two nodes (got 'b' twice)",
        "network.yaml:15: a second route from b to a",
    ]


@given(st.integers(0, 2**32 - 1))
def test_routes_are_those_of_another_search(seed):
    """Otherwise the search might miss shorter ways, or take another one of several equal ways.

    Of equal ways the node that is settled first wins, in networkx as here.
    """
    dice = random.Random(seed)
    names = [f"n{number}" for number in range(dice.randint(2, 20))]
    pairs = {tuple(sorted(dice.sample(names, 2))) for _ in range(dice.randint(1, 50))}
    links = [link(a, b) for a, b in pairs]
    graph = nx.Graph()
    graph.add_nodes_from(sorted(names))
    graph.add_edges_from(sorted(pairs))
    before, _ = nx.dijkstra_predecessor_and_distance(graph, "n0")
    routes = routes_from(["n0"], names, links)["n0"]
    assert routes.keys() == before.keys()
    for target, route in routes.items():
        way = [target]
        while before[way[-1]]:
            way.append(before[way[-1]][0])
        assert route == tuple(reversed(way))

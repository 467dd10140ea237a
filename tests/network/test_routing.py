"""Routes: least delay, and one result whatever the order in which a network is written down."""

import random

from hypothesis import given
from hypothesis import strategies as st

from tieline.network.queues import DropTail
from tieline.network.routing import routes_from
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

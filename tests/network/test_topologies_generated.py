"""Generated topologies of any size: connected, readable, repeatable, as redundant as promised."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.errors import InputError
from tieline.network.settings import NetworkSettings
from tieline.network.spec import Node
from tieline.network.topologies.draft import Draft, DraftLink, LinkDefaults
from tieline.network.topologies.flat import mesh, ring
from tieline.network.topologies.generate import generated
from tieline.network.topologies.options import Options
from tieline.network.topologies.places import random_land
from tieline.network.topologies.shared_risk import severing_corridors
from tieline.network.topologies.write import as_rate, as_yaml, write_draft
from tieline.network.topology import read_topology

REDUNDANT = ("ring", "mesh", "hierarchical")


@given(
    kind=st.sampled_from(("star", *REDUNDANT)),
    count=st.integers(4, 60),
    seed=st.integers(0, 2**40),
    regions=st.integers(1, 6),
    ring_size=st.integers(3, 8),
    core=st.sampled_from(("ring", "mesh")),
    has_centres=st.booleans(),
)
@settings(max_examples=60)
def test_every_seed_and_size_gives_the_redundancy_that_its_kind_promises(
    kind, count, seed, regions, ring_size, core, has_centres
):
    """Otherwise a study of failures would be cut off by its own generator.

    A star's links are single points of failure; of all others no link and no node is one, control
    centres included.
    """
    options = Options(
        degree=2.5, regions=min(regions, count), ring_size=ring_size, core=core,
        has_centres=has_centres,
    )  # fmt: skip
    graph = generated(kind, count, seed, 50.0, options).graph()
    assert nx.is_connected(graph)
    if kind == "star":
        assert graph.number_of_edges() == count - 1
    else:
        assert not list(nx.bridges(graph))
        assert nx.is_biconnected(graph)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_the_smallest_hierarchies_are_redundant_with_any_number_of_regions(count):
    """Otherwise regions of one or two substations, where gateways coincide, would be cut off."""
    for regions in range(1, count + 1):
        options = Options(regions=regions, has_centres=True)
        assert nx.is_biconnected(generated("hierarchical", count, 1, 50.0, options).graph())


@given(kind=st.sampled_from(("star", *REDUNDANT)), count=st.integers(3, 30), seed=st.integers(0, 9))
@settings(max_examples=15)
def test_what_is_written_is_read_back_as_the_same_network(tmp_path_factory, kind, count, seed):
    """Otherwise a generator would write files that an experiment refuses or misunderstands."""
    draft = generated(kind, count, seed, 80.0, Options())
    path = tmp_path_factory.mktemp("t") / "net.yaml"
    write_draft(draft, path)
    sources = [{"name": "pmu", "bus": 1}]
    destinations = [{"name": "ctl", "unit": "G", "bus": count}]
    spec = read_topology(path, sources, destinations, NetworkSettings())
    assert spec.nodes == draft.nodes
    assert [(link.a, link.b, link.propagation_ns) for link in spec.links] == [
        (link.a, link.b, link.propagation_ns) for link in draft.links
    ]
    assert {link.rate_bps for link in spec.links} == {20_000_000}
    assert len(spec.flows) == 1


def test_the_seed_alone_decides():
    """Otherwise nobody could repeat a run on a generated network."""
    one, again, other = (
        as_yaml(generated("hierarchical", 80, seed, 50.0, Options())) for seed in (7, 7, 8)
    )
    assert one == again
    assert one.splitlines()[5:] != other.splitlines()[5:]


def test_lengths_are_the_distances_on_the_page_times_the_factor():
    """Otherwise delays would not belong to the places: 1.5 x distance x 5 us/km, to 1 us."""
    draft = generated("mesh", 40, 3, 50.0, Options())
    at = {node.name: np.array([node.x, node.y]) for node in draft.nodes}
    for link in draft.links:
        km = 1.5 * np.hypot(*(at[link.a] - at[link.b]))
        assert link.propagation_ns == pytest.approx(km * 5_000, abs=501)


def test_a_mesh_has_the_degree_asked_for_up_to_every_pair():
    """Otherwise a sweep over the degree of a mesh would repeat one network."""
    places = random_land(12, 1, 50.0, 1.5)
    for degree, links in ((2, 12), (3, 18), (4.5, 27), (11, 66)):
        pairs = mesh(places, degree)
        assert len(pairs) == links
        assert all(a < b for a, b in pairs)


def test_a_ring_of_points_on_a_circle_goes_around_the_circle():
    """Otherwise rings would cross the country: the shortest tour is known here."""
    angles = 2 * np.pi * np.random.default_rng(1).permutation(24) / 24
    places = random_land(24, 1, 50.0, 1.0)
    places.xy_km = 100 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    step = 2 * 100 * np.sin(np.pi / 24)
    for a, b in ring(places, range(24)):
        assert places.way(a, b).km == pytest.approx(step)


def test_two_and_one_place_have_no_ring():
    """Otherwise a region of two would have one link twice, which a topology file refuses."""
    places = random_land(5, 1, 50.0, 1.0)
    assert ring(places, [3, 1]) == [(1, 3)]
    assert ring(places, [2]) == []


def test_the_core_is_a_ring_or_a_mesh_of_the_first_gateways():
    """Otherwise --core would do nothing: 5 regions have 5 or 10 links in the first plane."""
    count = {
        core: len(generated("hierarchical", 60, 2, 50.0, Options(regions=5, core=core)).links)
        for core in ("ring", "mesh")
    }
    assert count["mesh"] - count["ring"] == 5


def test_every_link_can_have_one_length_or_one_propagation():
    """Otherwise a theory that knows one hop's delay could not be compared."""
    of_time = generated("ring", 9, 1, 50.0, Options(links=LinkDefaults(propagation_ns=1_234_567)))
    assert {link.propagation_ns for link in of_time.links} == {1_234_567}
    assert "1.234567 ms" in as_yaml(of_time)
    of_km = generated("ring", 9, 1, 50.0, Options(links=LinkDefaults(km=40.0)))
    assert {link.propagation_ns for link in of_km.links} == {200_000}


@pytest.mark.parametrize("kind", ["star", "hierarchical"])
def test_ten_thousand_nodes_are_made(kind):
    """Otherwise scaling could not be studied: a wrong order of growth would time out here."""
    draft = generated(kind, 10_000, 1, 50.0, Options())
    graph = draft.graph()
    assert nx.is_connected(graph)
    assert kind == "star" or nx.is_biconnected(graph)


def test_links_that_share_a_corridor_are_cut_together():
    """Otherwise 'redundant' would be said of two links in one cable."""
    links = (
        DraftLink("a", "b", 1000, through=("m",)),
        DraftLink("a", "c", 1000, through=("m",)),
        DraftLink("b", "c", 1000),
    )
    assert severing_corridors(["a", "b", "c"], links) == {("a", "m"): ("a",)}


@given(
    names=st.lists(
        st.text(st.characters(exclude_categories=("Cc", "Cs", "Cn", "Co")), min_size=1),
        min_size=2, max_size=5, unique=True,
    )
)  # fmt: skip
@settings(max_examples=60)
def test_any_name_survives_the_file(tmp_path_factory, names):
    """Otherwise Norway's node, No, would become the word false."""
    nodes = tuple(Node(name) for name in (*names, "No", "null", "1e3", "a: {b"))
    nodes = tuple(dict.fromkeys(nodes))
    links = tuple(DraftLink(nodes[0].name, node.name, 1000) for node in nodes[1:])
    path = tmp_path_factory.mktemp("t") / "net.yaml"
    write_draft(Draft(("a\nb #",), LinkDefaults(), nodes, links), path)
    spec = read_topology(path, [], [], NetworkSettings())
    assert [node.name for node in spec.nodes] == [node.name for node in nodes]


@pytest.mark.parametrize(
    ("rate_bps", "text"),
    [
        (20_000_000, "20 Mbit/s"),
        (155_520_000, "155.52 Mbit/s"),
        (2_048_000, "2048 kbit/s"),
        (2_500_000_000, "2.5 Gbit/s"),
        (1_234_567, "1234567 bit/s"),
    ],
)
def test_rates_are_written_exactly(rate_bps, text):
    """Otherwise a file would round a rate that the serialisation delay depends on."""
    assert as_rate(rate_bps) == text


@pytest.mark.parametrize(
    ("kind", "count", "options", "message"),
    [
        ("ring", 2, Options(), "--nodes must be from 3 to 100000 for ring (got 2)"),
        ("along-lines", 9, Options(), "give a case, not --nodes"),
        ("mesh", 9, Options(degree=9), "--degree must be from 2 to 8 for 9 nodes (got 9)"),
        ("star", 9, Options(hub="S99"), "--hub 'S99' is none of the 9 nodes, S1 to S9"),
        ("hierarchical", 9, Options(regions=10), "--regions must be from 1 to 9 nodes (got 10)"),
        ("hierarchical", 9, Options(ring_size=2), "--ring-size must be 3 or more (got 2)"),
        ("hierarchical", 9, Options(core="star"), "--core must be ring or mesh (got 'star')"),
    ],
)
def test_what_cannot_be_made_is_refused_with_what_can(kind, count, options, message):
    """Otherwise a slip would give another network, or a traceback."""
    with pytest.raises(InputError) as caught:
        generated(kind, count, 1, 50.0, options)
    assert message in str(caught.value)

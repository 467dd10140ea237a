"""The connected parts of a network, against networkx."""

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from tieline.network.parts import parts_of

NODES = st.integers(0, 30)


@given(st.lists(st.tuples(NODES, NODES), max_size=40))
def test_parts_are_those_of_any_graph_the_largest_first(pairs: list[tuple[int, int]]) -> None:
    """A network in two parts would otherwise be simulated, with packets that nobody can get."""
    graph: nx.Graph[int] = nx.Graph(pairs)
    graph.add_nodes_from(range(31))
    expected = sorted(nx.connected_components(graph), key=lambda part: (-len(part), min(part)))
    assert parts_of(range(31), pairs) == expected

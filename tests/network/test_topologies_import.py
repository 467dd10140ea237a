"""Imported topologies: small files in the style of the Internet Topology Zoo, checked by hand."""

from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.network.topologies.assign import by_table, evenly
from tieline.network.topologies.draft import Draft, LinkDefaults
from tieline.network.topologies.graph_file import rate_of_label, read_graph
from tieline.network.topologies.importing import ImportOptions, great_circle_km, imported
from tieline.network.topologies.power_grid import Branch, Bus, PowerGrid
from tieline.network.topologies.write import as_yaml

ZOO = Path(__file__).parent / "data" / "zoo"


def of(name: str, **options: object) -> Draft:
    return imported(read_graph(ZOO / name), ImportOptions(**options))


def refusal(name: str, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        of(name, **options)
    return str(caught.value)


def test_great_circles_against_known_ones():
    """Otherwise every delay of an imported network would be wrong.

    A quarter of the earth along the equator and over the pole; a degree of latitude is 111.19 km.
    """
    assert great_circle_km((0, 0), (0, 90)) == pytest.approx(6371 * 3.14159265 / 2)
    assert great_circle_km((0, 17), (90, 5)) == pytest.approx(6371 * 3.14159265 / 2)
    assert great_circle_km((50, 8), (51, 8)) == pytest.approx(111.195, abs=0.001)
    assert great_circle_km((-18.14, 178.44), (-18.14, -181.56)) == pytest.approx(0, abs=1e-6)


def test_parallel_edges_become_one_link_with_the_sum_of_what_is_known():
    """Otherwise the reader would refuse the file, or one circuit would stand for three.

    Amsterdam - Bern: 2.5 Gbit/s, STM-4 (622.08 Mbit/s) and a dark fibre of unknown rate.
    """
    draft = of("parallel.gml")
    rates = {(link.a, link.b): link.rate_bps for link in draft.links}
    assert rates == {
        ("Amsterdam", "Bern"): 3_122_080_000,
        ("Amsterdam", "No"): None,
        ("Bern", "No"): 155_000_000,
    }
    # 631 km apart, 1.5 times that in cable, 5 us/km.
    (link,) = [link for link in draft.links if (link.a, link.b) == ("Amsterdam", "Bern")]
    assert link.propagation_ns == pytest.approx(1.5 * 631 * 5_000, rel=0.002)
    words = " ".join(" ".join(draft.made_by).split())
    assert "changed: 1 external nodes were left out; 2 parallel edges were merged" in words


def test_external_nodes_are_kept_on_request():
    """Otherwise peers that carry the traffic could not be studied."""
    draft = of("parallel.gml", has_external=True, missing="neighbours")
    (peer,) = [node for node in draft.nodes if node.name == "Elsewhere"]
    (neighbour,) = [node for node in draft.nodes if node.name == "No"]
    assert (peer.x, peer.y) == (neighbour.x, neighbour.y)


def test_nodes_without_coordinates_are_refused_filled_or_dropped():
    """Otherwise a link would have a length that nobody chose."""
    text = refusal("islands.graphml", has_largest_only=True)
    assert "1 nodes have no Latitude and Longitude: 'Landing' (--missing neighbours" in text
    filled = of("islands.graphml", has_largest_only=True, missing="neighbours")
    assert {node.name for node in filled.nodes} == {"Auckland", "Suva", "Apia", "Landing"}
    # Half-way between Suva and Apia, which lie on either side of 180 degrees: 1,147 km apart.
    lengths = [link.km for link in filled.links if "Landing" in (link.a, link.b)]
    assert sum(lengths) == pytest.approx(
        1.5 * great_circle_km((-18.14, 178.44), (-13.83, -171.77)), rel=0.001
    )
    assert max(abs(node.x) for node in filled.nodes) < 1000
    dropped = of("islands.graphml", has_largest_only=True, missing="drop")
    assert {node.name for node in dropped.nodes} == {"Auckland", "Suva"}


def test_unconnected_parts_are_refused_or_the_largest_is_kept():
    """Otherwise a controller would wait for frames that no link can bring."""
    text = refusal("islands.graphml", missing="neighbours")
    assert "is in 2 parts; no edge joins 'Tarawa', 'Tarawa' to the largest, of 4 nodes" in text
    assert "--largest" in text


def test_labels_that_repeat_are_told_apart_by_their_keys(tmp_path):
    """Otherwise two towns of one name would become one node."""
    text = (ZOO / "islands.graphml").read_text(encoding="utf-8")
    path = tmp_path / "joined.graphml"
    path.write_text(
        text.replace('<edge id="e2"', '<edge id="e9" source="5" target="0"/><edge id="e2"'),
        encoding="utf-8",
    )
    draft = imported(read_graph(path), ImportOptions(missing="neighbours"))
    names = {node.name for node in draft.nodes}
    assert {"Tarawa (4)", "Tarawa (5)"} <= names
    rates = {frozenset((link.a, link.b)): link.rate_bps for link in draft.links}
    assert rates[frozenset(("Tarawa (4)", "Tarawa (5)"))] == 34_368_000
    assert rates[frozenset(("Auckland", "Suva"))] == 20_000_000_000


def test_no_coordinates_are_needed_where_every_link_has_one_propagation():
    """Otherwise a plain GraphML file could not be used at all."""
    draft = of(
        "islands.graphml", has_largest_only=True, links=LinkDefaults(propagation_ns=2_000_000)
    )
    assert {link.propagation_ns for link in draft.links} == {2_000_000}
    assert "Landing:\n" in as_yaml(draft)


@pytest.mark.parametrize(
    ("label", "rate_bps"),
    [
        ("2.5 Gbps", 2_500_000_000),
        ("10Gb/s", 10_000_000_000),
        ("155 Mbps", 155_000_000),
        ("<= 622 Mbit/s", 622_000_000),
        ("OC-48c", 2_488_320_000),
        ("OC-48", 2_488_320_000),
        ("STM-16", 2_488_320_000),
        ("E3", 34_368_000),
        ("DS3 (T3)", 44_736_000),
        ("Lit Fiber", None),
        ("", None),
    ],
)
def test_link_labels(label, rate_bps):
    """Otherwise a backbone would run at the rate of an access line."""
    assert rate_of_label(label) == rate_bps


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.txt", "", "must be a file in .graphml or .gml (got '.txt')"),
        ("a.graphml", "<graphml", "a.graphml:1: is no XML"),
        ("a.gml", "graph [ node [ id 0 ] edge [ source 0 target 5 ] ]", "is no gml that can be"),
        ("a.gml", "graph [ ]", "holds no node"),
        (
            "a.gml",
            'graph [ node [ id 0 label "N" Latitude 91.0 Longitude 0.0 ] ]',
            "node 'N': Latitude must be from -90 to 90",
        ),
        (
            "a.gml",
            "graph [ node [ id 0 ] node [ id 1 ] edge [ source 0 target 1 LinkSpeedRaw -1 ] ]",
            "edge 0-1: LinkSpeedRaw must be from 0, unknown, to 1e+13 bit/s (got -1)",
        ),
    ],
)
def test_a_faulty_file_is_refused_with_the_place(tmp_path, name, text, message):
    """Otherwise a wrong file would end in a traceback of the reader."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_graph(path)
    assert message in str(caught.value)


GRID = PowerGrid(
    "tiny", 100.0, ("",), (Bus(1, 20.0), Bus(2, 500.0), Bus(3, 500.0)),
    (Branch(1, 2, 0.0, 0.01, "transformer"), Branch(2, 3, 0.001, 0.1)),
)  # fmt: skip


def test_buses_stand_where_the_table_says(tmp_path):
    """Otherwise PMUs would report from other cities than those chosen."""
    table = tmp_path / "buses.csv"
    table.write_text("bus,node\n1,Bern\n2,Bern\n3,No\n", encoding="utf-8")
    draft = by_table(of("parallel.gml"), GRID, table)
    assert {node.name: node.buses for node in draft.nodes} == {
        "Amsterdam": (), "Bern": (1, 2), "No": (3,),
    }  # fmt: skip


def test_a_faulty_table_is_refused_with_every_line(tmp_path):
    """Otherwise a user would repair it in as many rounds as it has faults."""
    table = tmp_path / "buses.csv"
    table.write_text("bus,node\n1,Berne\n1,Bern\n7,No\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        by_table(of("parallel.gml"), GRID, table)
    found = [finding.removeprefix(f"{tmp_path}/") for finding in caught.value.findings]
    assert found == [
        "buses.csv:2: no node 'Berne' (did you mean 'Bern'?)",
        "buses.csv:3: bus 1 is assigned twice",
        "buses.csv:4: no bus 7 in case 'tiny' (allowed: 1, 2, 3)",
        "buses.csv: 2 buses of case 'tiny' have no node: 2, 3",
    ]
    table.write_text("bus;node\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"buses.csv:1: needs the columns bus and node"):
        by_table(of("parallel.gml"), GRID, table)


def test_stations_are_dealt_evenly_and_stay_whole():
    """Otherwise a unit and its transformer would be in two cities."""
    draft = evenly(of("parallel.gml"), GRID)
    assert [node.buses for node in draft.nodes] == [(1, 2), (3,), ()]

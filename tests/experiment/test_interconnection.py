"""What is kept of an interconnection for drawing it, and where its parts are placed."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tieline.experiment.interconnection import GIVEN, LAID_OUT, interconnection, placed
from tieline.experiment.power_grid import power_grid
from tieline.network.queues import DropTail
from tieline.network.spec import Link, LinkCut, LinkRepair, NetworkSpec, Node
from tieline.network.topologies.power_grid import Branch, Bus, PowerGrid

# 1 = 2 --- 3 --- 4, and 5 alone: 1 and 2 are one station, 2 and 4 have a PMU.
GRID = PowerGrid(
    "five",
    100.0,
    ("west", "east", "far"),
    tuple(Bus(n, kv, area) for n, kv, area in (
        (1, 20.0, "west"), (2, 230.0, "west"), (3, 230.0, "east"), (4, 230.0, "east"),
        (5, 230.0, "far"))),
    (
        Branch(1, 2, 0.0, 0.1, "transformer"),
        Branch(2, 3, 0.01, 0.1),
        Branch(2, 3, 0.01, 0.1),
        Branch(3, 4, 0.01, 0.1),
    ),
    pmus=(2, 4),
)  # fmt: skip


def network(*nodes: Node, changes: tuple[LinkCut | LinkRepair, ...] = ()) -> NetworkSpec:
    """Return a chain of nodes."""
    links = tuple(
        Link(a.name, b.name, 1_000_000, 1_000_000, DropTail(10)) for a, b in pairwise(nodes)
    )
    return NetworkSpec(nodes, links, (), (), (), changes=changes)


def test_stations_lines_and_units_are_those_of_the_grid() -> None:
    """Otherwise the drawing would show another grid."""
    found = interconnection(GRID, [("G1", 1)], None)
    assert [(s["name"], s["buses"], s["bus"]) for s in found["stations"]] == [
        ("S002", [1, 2], 2),
        ("S003", [3], 3),
        ("S004", [4], 4),
        ("S005", [5], 5),
    ]
    assert [(x["a"], x["b"], x["circuits"]) for x in found["lines"]] == [
        ("S002", "S003", 2),
        ("S003", "S004", 1),
    ]
    assert found["units"] == [{"name": "G1", "bus": 1, "station": "S002"}]
    assert found["nodes"] == found["links"] == []


def test_the_places_of_a_topology_are_kept() -> None:
    """Otherwise a drawing would not look like the map that its author drew."""
    nodes = (Node("S002", (2,), 0.0, 0.0), Node("mid", (3,), 10.0, 5.0), Node("CC_x", (), 9.0, 9.0))
    found = placed(interconnection(GRID, [], network(*nodes)))
    assert found["places"] == GIVEN
    assert {s["name"]: (s["x"], s["y"]) for s in found["stations"]}["mid"] == (10.0, 5.0)
    assert [node["kind"] for node in found["nodes"]] == [
        "substation",
        "substation",
        "control centre",
    ]


def test_a_station_without_a_node_stands_near_its_neighbour() -> None:
    """Otherwise a bus without a router would have no frequency in the drawing, or hide another."""
    nodes = (Node("S002", (2,), 0.0, 0.0), Node("S003", (3,), 100.0, 0.0))
    found = placed(interconnection(GRID, [], network(*nodes)))
    at = {s["name"]: s["x"] for s in found["stations"]}
    assert 50 < at["S004"] < 100
    assert at["S005"] == 50


def test_two_stations_at_one_node_are_drawn_as_one() -> None:
    """Otherwise they would cover each other."""
    found = interconnection(GRID, [], network(Node("town", (3, 4)), Node("S002", (2,))))
    assert [s["name"] for s in found["stations"]] == ["S002", "town", "S005"]
    assert [(x["a"], x["b"]) for x in found["lines"]] == [("S002", "town")]


@pytest.mark.parametrize(
    "spec", [None, network(Node("S002", (2,)), Node("hub"), Node("S004", (4,)))]
)
def test_without_coordinates_every_part_gets_a_place_of_its_own(spec: NetworkSpec | None) -> None:
    """Otherwise a case without a map could not be drawn; a part that nothing joins included."""
    found = placed(interconnection(GRID, [], spec))
    assert found["places"] == LAID_OUT
    places = {
        part["name"]: (part["x"], part["y"]) for part in [*found["stations"], *found["nodes"]]
    }
    assert len(places) == (4 if spec is None else 5)
    assert np.isfinite(list(places.values())).all()
    assert len(set(places.values())) == len(places)


def test_of_two_areas_the_first_stands_on_the_left() -> None:
    """Otherwise the two-area system would be drawn upside down, as nobody draws it."""
    grid = power_grid("two_area")
    found = placed(interconnection(grid, [], None))
    middle = {
        area: np.mean([s["x"] for s in found["stations"] if s["area"] == area and s["x"]])
        for area in grid.areas
    }
    assert middle[grid.areas[0]] < 0 < middle[grid.areas[1]]


def test_it_is_kept_when_a_link_is_down() -> None:
    """Otherwise the replay would show packets crossing a fibre that is cut."""
    changes = (LinkCut(1_000_000_000, 0), LinkRepair(2_500_000_000, 0))
    spec = network(Node("S002", (2,)), Node("S004", (4,)), changes=changes)
    assert interconnection(GRID, [], spec)["outages"] == [
        {"t_s": 1.0, "link": 0, "is_down": True},
        {"t_s": 2.5, "link": 0, "is_down": False},
    ]


def test_one_station_needs_no_line() -> None:
    """Otherwise the smallest case of all could not be drawn."""
    grid = replace(GRID, buses=GRID.buses[:1], branches=(), pmus=(), areas=("west",))
    (station,) = placed(interconnection(grid, [("G1", 1)], None))["stations"]
    assert (station["x"], station["y"]) == (0.0, 0.0)

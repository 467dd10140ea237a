"""Topologies of cases against the shipped files, which say how they were made."""

from itertools import pairwise

import networkx as nx
import pytest
import yaml

from tieline.errors import InputError
from tieline.experiment.power_grid import power_grid
from tieline.network.topologies.centres import Traffic
from tieline.network.topologies.draft import LinkDefaults
from tieline.network.topologies.generate import for_case
from tieline.network.topologies.hierarchical import Rates
from tieline.network.topologies.options import KINDS, Options
from tieline.network.topologies.power_grid import Branch, Bus, PowerGrid
from tieline.network.topologies.shared_risk import severing_corridors
from tieline.network.topologies.stations import corridors_of, stations_of
from tieline.network.topologies.write import as_yaml
from tieline.resources import shipped

MINIWECC = shipped("cases") / "miniwecc"


@pytest.fixture(scope="module")
def grid() -> PowerGrid:
    return power_grid("miniwecc")


def shipped_topology(name: str) -> dict:
    return yaml.safe_load((MINIWECC / name).read_text(encoding="utf-8"))


def test_along_lines_makes_the_shipped_network_again(grid):
    """Otherwise the rule in the shipped file's header would not be the rule of its links.

    Stations, their buses and order, links and their propagation are equal; so are link defaults
    and devices. x and y may differ by a turn and rounding: within 10 km of 2,000.
    """
    made = yaml.safe_load(as_yaml(for_case("along-lines", grid, Options())))
    old = shipped_topology("network.yaml")
    assert len(made["nodes"]) == 58
    assert list(made["nodes"]) == list(old["nodes"])
    assert made["links"] == old["links"]
    for key in ("link_defaults", "pmu", "controller"):
        assert made[key] == old[key]
    for name, node in made["nodes"].items():
        assert node["buses"] == old["nodes"][name]["buses"]
        assert node["x"] == pytest.approx(old["nodes"][name]["x"], abs=10)
        assert node["y"] == pytest.approx(old["nodes"][name]["y"], abs=10)


def test_the_shipped_wan_is_what_its_header_says(grid):
    """Otherwise nobody could tell where its figures come from."""
    options = Options(
        links=LinkDefaults(rate_bps=10_000_000),
        rates=Rates(core_bps=50_000_000, regional_bps=20_000_000),
        has_centres=True,
        traffic=Traffic(),
    )
    draft = for_case("hierarchical", grid, options)
    made, old = yaml.safe_load(as_yaml(draft)), shipped_topology("wan.yaml")
    for node in (*made["nodes"].values(), *old["nodes"].values()):
        # A layout's last digits are another library version's.
        node.pop("x"), node.pop("y")
    assert made == old


def test_no_link_and_no_node_of_the_wan_is_a_single_point_of_failure(grid):
    """Otherwise the network would not be the redundant one that its header promises."""
    old = shipped_topology("wan.yaml")
    graph = nx.Graph([(link["a"], link["b"]) for link in old["links"]])
    assert set(graph) == set(old["nodes"])
    assert nx.edge_connectivity(graph) == 2
    assert nx.node_connectivity(graph) == 2
    assert sum(name.startswith("CC_") for name in graph) == 6


def test_the_header_of_the_wan_names_every_corridor_whose_cut_parts_it(grid):
    """Otherwise its redundancy would be overstated: two links may lie in one cable."""
    draft = for_case("hierarchical", grid, Options(has_centres=True))
    cuts = severing_corridors([node.name for node in draft.nodes], draft.links)
    header = (MINIWECC / "wan.yaml").read_text(encoding="utf-8").split("link_defaults: {")[0]
    words = " ".join(header.replace("#", " ").split())
    for (a, b), lost in cuts.items():
        assert f"{a}-{b} ({', '.join(lost)})" in words
    # These are the corridors that the grid itself has no second way around.
    bridges = {("S002", "S080"), ("S004", "S079"), ("S006", "S106"), ("S031", "S084")}
    assert bridges | {("S075", "S101")} <= set(cuts)


@pytest.mark.parametrize("case", ["miniwecc", "two_area"])
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_made_of_every_case(case, kind):
    """Otherwise a case could lack a network of the kind that a study compares."""
    grid = power_grid(case)
    draft = for_case(kind, grid, Options())
    assert nx.is_connected(draft.graph())
    assert sorted(bus for node in draft.nodes for bus in node.buses) == sorted(
        bus.number for bus in grid.buses
    )
    if kind in ("ring", "mesh", "hierarchical"):
        assert nx.is_biconnected(draft.graph())


def test_a_link_is_as_long_as_the_corridors_that_it_names(grid):
    """Otherwise comments of the file would tell of other fibre than the delays."""
    stations = stations_of(grid)
    km = {(c.a, c.b): c.km for c in corridors_of(grid, stations)}
    for link in for_case("hierarchical", grid, Options()).links:
        stops = (link.a, *link.through, link.b)
        pairs = [tuple(sorted(pair)) for pair in pairwise(stops)]
        assert link.km == pytest.approx(sum(km[pair] for pair in pairs))


def tiny(*branches: Branch, pmus: tuple[int, ...] = ()) -> PowerGrid:
    buses = (Bus(1, 20.0), Bus(2, 500.0), Bus(3, 230.0), Bus(4, 500.0))
    return PowerGrid("tiny", 100.0, ("",), buses, branches, pmus)


def test_stations_by_hand():
    """Otherwise a unit would be far from its transformer, or a line would vanish in a station.

    A transformer without resistance joins; one with resistance is a line; a series capacitor joins.
    """
    up = Branch(1, 2, 0.0, 0.01, "generator step-up transformer")
    line = Branch(2, 3, 0.001, 0.0325, "transformer")
    capacitor = Branch(3, 4, 0.0, -0.01, "series capacitor")
    grid = tiny(up, line, capacitor)
    stations = stations_of(grid)
    assert [(s.name, s.buses) for s in stations] == [("S002", (1, 2)), ("S004", (3, 4))]
    assert [s.name for s in stations_of(tiny(up, line, capacitor, pmus=(3,)))] == ["S002", "S003"]
    (corridor,) = corridors_of(grid, stations)
    # 0.0325 pu at 500 kV and 100 MVA are 81.25 ohm: 250 km of 0.325 ohm/km.
    assert (corridor.a, corridor.b, corridor.km) == ("S002", "S004", pytest.approx(250.0))


def test_a_grid_in_parts_is_refused_with_its_parts():
    """Otherwise no fibre along lines could join it, and the search would end in a traceback."""
    with pytest.raises(InputError, match=r"no line joins S004 to the other 2 stations"):
        for_case(
            "star", tiny(Branch(1, 2, 0, 0.01, "transformer"), Branch(2, 3, 0.01, 0.1)), Options()
        )

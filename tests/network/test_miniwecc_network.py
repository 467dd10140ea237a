"""The miniWECC's communication network against the branch table that it is derived from."""

import csv
from functools import cache
from itertools import pairwise
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from tieline.cosim.interfaces import Clock, FrameBundle
from tieline.network.federate import open_participant
from tieline.network.settings import NetworkSettings
from tieline.network.spec import FRAME_BYTES, NetworkSpec, packet_bytes
from tieline.network.topology import read_topology
from tieline.resources import shipped
from tieline.tables import read_table

CASE = shipped("cases") / "miniwecc"
PMU_BUSES = [2, 4, 6, 10, 13, 15, 18, 20, 24, 28, 31, 33, 35, 38, 44, 46, 115, 49, 52, 54, 57, 61]
PMU_BUSES += [63, 66, 69, 72, 75, 77, 108, 119]

OHM_PER_KM = {500: 0.325, 345: 0.367, 230: 0.488}
"""Kundur, Power System Stability and Control (1994), table 6.1."""

NS_PER_KM = 5_000
"""ITU-T G.114, annex A."""

SITE_REACTANCE_PU = 0.0011


def rows(name: str) -> list[dict[str, str]]:
    """Return the rows of one of the case's tables."""
    with (CASE / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def sites() -> tuple[list[dict], list[dict]]:
    """Return PMUs and controllers as the run file lists them."""
    sources = [{"name": f"pmu{i:02d}", "bus": bus} for i, bus in enumerate(PMU_BUSES)]
    machines = rows("machine")
    destinations = [
        {"name": f"ctl{j:02d}", "unit": machine["unit"], "bus": int(machine["bus"])}
        for j, machine in enumerate(machines)
    ]
    return sources, destinations


@cache
def network(**settings: float) -> NetworkSpec:
    """Return the network with 30 PMUs and 34 controllers."""
    return read_topology(CASE / "network.yaml", *sites(), NetworkSettings(**settings))


def is_inside_a_site(branch: dict[str, str]) -> bool:
    """Return whether a branch joins two buses of one station, by the rule of the file's header."""
    has_no_resistance = float(branch["resistance_pu"]) == 0
    is_transformer = "transformer" in branch["kind"] and has_no_resistance
    return is_transformer or abs(float(branch["reactance_pu"])) <= SITE_REACTANCE_PU


def test_each_bus_belongs_to_one_station():
    """Otherwise a sensor at some bus would have no network, or two."""
    buses = [bus for node in network().nodes for bus in node.buses]
    assert sorted(buses) == sorted(int(row["bus"]) for row in rows("bus"))
    assert len(buses) == 122


def test_stations_are_what_transformers_join():
    """Otherwise a unit would be far from its own step-up transformer."""
    graph = nx.Graph()
    graph.add_nodes_from(int(row["bus"]) for row in rows("bus"))
    for branch in rows("branch"):
        if is_inside_a_site(branch):
            graph.add_edge(int(branch["from_bus"]), int(branch["to_bus"]))
    expected = {tuple(sorted(part)) for part in nx.connected_components(graph)}
    assert {tuple(sorted(node.buses)) for node in network().nodes} == expected
    for node in network().nodes:
        assert node.name.startswith("S")
        assert int(node.name[1:]) in node.buses


def test_links_follow_the_lines_at_the_speed_of_light_in_fibre():
    """Otherwise the delays would not be those of the grid that is simulated.

    Re-derived from the branch table: length = reactance / (ohm per km), 5 us per km, and of
    parallel circuits the shortest.
    """
    voltage_kv = {int(row["bus"]): float(row["base_kV"]) for row in rows("bus")}
    station = {bus: node.name for node in network().nodes for bus in node.buses}
    expected: dict[tuple[str, str], float] = {}
    for branch in rows("branch"):
        if is_inside_a_site(branch):
            continue
        a, b = int(branch["from_bus"]), int(branch["to_bus"])
        kv = max(voltage_kv[a], voltage_kv[b])
        ohm = float(branch["reactance_pu"]) * kv**2 / 100
        pair = tuple(sorted((station[a], station[b])))
        propagation_ns = ohm / OHM_PER_KM[int(kv)] * NS_PER_KM
        expected[pair] = min(propagation_ns, expected.get(pair, np.inf))
    given = {tuple(sorted((link.a, link.b))): link.propagation_ns for link in network().links}
    assert given.keys() == expected.keys()
    # The file rounds to a microsecond.
    assert max(abs(given[pair] - expected[pair]) for pair in expected) <= 500.001


def test_the_header_states_the_busiest_link_and_the_mean():
    """Otherwise the comments of the file would tell of another network."""
    spec = network()
    flows: dict[tuple[str, str], int] = {}
    for flow in spec.flows:
        for pair in pairwise(flow.route):
            flows[pair] = flows.get(pair, 0) + 1
    busiest = max(flows, key=lambda pair: flows[pair])
    assert set(busiest) == {"S101", "S105"}
    rate_bps = flows[busiest] * 60 * 8 * packet_bytes(spec.links[0], FRAME_BYTES)
    assert rate_bps == pytest.approx(5.6e6, abs=0.05e6)
    assert spec.mean_unloaded_delay_ns == pytest.approx(98.9e6, abs=0.05e6)


@pytest.mark.parametrize("target", [0.1, 0.25, 0.5, 1.0, 1.25])
def test_every_mean_delay_of_the_study_can_be_reached(target):
    """Otherwise the experiments that are shipped would be refused."""
    assert network(mean_delay=target).mean_unloaded_delay_ns == pytest.approx(target * 1e9, abs=1)


def run_for(folder: Path, intervals: int) -> None:
    """Carry frames through the network for some intervals and write its tables to `folder`."""
    sources, destinations = sites()
    run = {
        "seed": 1,
        "frequency_hz": 60.0,
        "clock": {"rate_hz": 60, "intervals": intervals},
        "network": {"engine": "packet", "topology": str(CASE / "network.yaml")},
        "sources": sources,
        "destinations": destinations,
    }
    participant = open_participant(run, folder)
    clock = Clock(60, intervals)
    payloads = np.zeros((30, FRAME_BYTES), np.uint8)
    for k in range(intervals):
        participant.advance(k, FrameBundle(clock.at_ns(k), payloads).to_bytes())
    participant.finish()


def test_combined_delays_of_the_base_case_lie_between_95_and_125_ms(tmp_path):
    """Otherwise the base case would not be the wide-area control that the papers speak of.

    Four seconds: 244,800 packets. Practically all means 99.9 %; queues form but drop nothing.
    """
    run_for(tmp_path, 240)
    delays = read_table(tmp_path / "delays.parquet")
    # The edges of the bins are multiples of 0.1 ms, as floating-point numbers.
    is_inside = (delays["bin_low_s"] > 0.095 - 1e-9) & (delays["bin_high_s"] < 0.125 + 1e-9)
    assert delays["count"][is_inside].sum() > 0.999 * delays["count"].sum()
    flows, links = (read_table(tmp_path / f"{name}.parquet") for name in ("flows", "links"))
    assert flows["dropped_queue"].sum() == flows["dropped_loss"].sum() == 0
    assert flows["sent"].sum() == 1020 * 240
    assert links["max_queue"].max() > 20
    assert 0.5 < links["utilisation"].max() < 0.95
    queueing_s = flows["delay_mean_s"].mean() - network().mean_unloaded_delay_ns / 1e9
    assert 0.0005 < queueing_s < 0.003

"""`network.jitter`: the jitter of every link, said by the experiment."""

import json
from pathlib import Path

from tieline.network.jitter import EmpiricalJitter, UniformJitter
from tieline.network.settings import NetworkSettings
from tieline.network.topology import read_topology

TOPOLOGY = """\
link_defaults: {rate: 10 Mbit/s, queue: 20}
nodes: {a: {buses: [1]}, b: {}, c: {buses: [2]}}
links:
  - {a: a, b: b, propagation: 1 ms, jitter: {distribution: constant, delay: 2 ms}}
  - {a: b, b: c, propagation: 1 ms}
"""
SITES = [{"name": "pmu00", "bus": 1}], [{"name": "ctl00", "unit": "G1", "bus": 2}]


def test_it_stands_in_for_that_of_every_link(tmp_path: Path) -> None:
    """Otherwise a sweep over jitter would leave out links that have their own."""
    (tmp_path / "net.yaml").write_text(TOPOLOGY)
    jitter = {"distribution": "uniform", "low": 0, "high": "4 ms"}
    settings = NetworkSettings.model_validate({"jitter": jitter})
    spec = read_topology(tmp_path / "net.yaml", *SITES, settings)
    assert [link.jitter for link in spec.links] == [UniformJitter(0, 4_000_000)] * 2


def test_a_sample_reaches_the_network_federate_through_the_run_file(tmp_path: Path) -> None:
    """Otherwise the federate would refuse what the experiment's check let pass."""
    (tmp_path / "sample.csv").write_text("delay_s\n0.001\n0.003\n")
    jitter = {"distribution": "empirical", "file": "sample.csv"}
    settings = NetworkSettings.model_validate({"jitter": jitter}, context={"folder": tmp_path})
    again = NetworkSettings.model_validate(json.loads(settings.model_dump_json()))
    assert again.jitter is not None
    assert again.jitter.jitter() == EmpiricalJitter((1_000_000, 3_000_000))


def test_a_priority_queue_reaches_the_network_federate_through_the_run_file() -> None:
    """Otherwise classes without a limit in bytes would be refused at the start of a run."""
    queue = {"discipline": "priority", "classes": [{"dscp": [46], "packets": 9}, {"packets": 9}]}
    settings = NetworkSettings.model_validate({"queue": queue})
    again = NetworkSettings.model_validate(json.loads(settings.model_dump_json()))
    assert again == settings

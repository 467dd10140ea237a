"""Topology files, and graphs from elsewhere: a network, or what is wrong with it."""

import copy
import functools
from pathlib import Path
from typing import Any

import yaml

from fuzz.script import Script, as_yaml, edited, edited_text, edited_tree, scratch
from tieline.errors import InputError
from tieline.network.settings import NetworkSettings
from tieline.network.topologies.graph_file import read_graph
from tieline.network.topologies.importing import MISSING, ImportOptions, imported
from tieline.network.topologies.write import as_yaml as written
from tieline.network.topology import read_topology
from tieline.resources import case_folder

ZOO = Path(__file__).parents[1] / "network" / "data" / "zoo"
SOURCES = [{"name": "pmu00", "bus": 2}, {"name": "pmu01", "bus": 119}]
DESTINATIONS = [
    {"name": "ctl00", "unit": "G1", "bus": 17},
    {"name": "ctl01", "unit": "G34", "bus": 118},
]
SMALL = """\
link_defaults: {rate: 10 Mbit/s, queue: 50, overhead: 9}
pmu: {processing: 60 ms, jitter: {distribution: uniform, low: 1 ms, high: 3 ms}, dscp: ef}
controller: {processing: 5 ms}
nodes:
  north: {buses: [2, 17], x: 0, y: 10}
  middle:
  south: {buses: [118, 119]}
links:
  - {a: north, b: middle, propagation: 2 ms, mtu: 1500 B}
  - {a: south, b: middle, propagation: 0.25 ms, rate: 512 kbit/s, queue: 7, loss: 0.01}
  - {a: north, b: south, propagation: 1 ms, loss: {model: bit_error, rate: 1e-6}}
events:
  - {at: 1 s, for: 500 ms, event: link_down, link: [north, middle]}
  - {at: 2 s, event: rate, link: [south, middle], rate: 1 Mbit/s}
  - {at: 3 s, event: loss, probability: 0.1}
routing: {convergence: 50 ms}
cross_traffic:
  - {kind: poisson, from: north, to: south, rate: 100 kbit/s, payload: 222}
"""


def one_input(data: bytes) -> None:
    """Read what an input makes of a topology or of a graph."""
    script = Script(data)
    try:
        _import_one(script) if script.below(3) == 0 else _read_one(script)
    except InputError as error:
        assert error.findings, "an error without a finding"
        assert all("Traceback" not in text for text in error.findings)


def _read_one(script: Script) -> None:
    path, sources = scratch() / "network.yaml", _sources()
    manner, (text, tree) = script.below(8), script.one(sources)
    if manner == 0:
        content = script.rest()
    elif manner < 3:
        content = edited_text(text, script)
    else:
        content = as_yaml(edited_tree(copy.deepcopy(tree), script))
    path.write_bytes(content)
    read_topology(path, SOURCES, DESTINATIONS, NetworkSettings())


def _import_one(script: Script) -> None:
    """Import a graph; what is written of one that could be read must be a topology file."""
    whole = script.one(sorted(ZOO.iterdir()))
    path = scratch() / f"graph{whole.suffix}"
    manner = script.below(4)
    if manner == 0:
        path.write_bytes(script.rest())
    elif manner == 1:
        path.write_bytes(edited(whole.read_bytes(), script))
    else:
        path.write_bytes(edited_text(whole.read_text(encoding="utf-8"), script))
    options = ImportOptions(missing=script.one(MISSING), has_largest_only=bool(script.below(2)))
    draft = imported(read_graph(path), options)
    yaml.safe_load(written(draft))


@functools.cache
def _sources() -> list[tuple[str, Any]]:
    texts = [SMALL, (case_folder("miniwecc") / "network.yaml").read_text(encoding="utf-8")]
    return [(text, yaml.safe_load(text)) for text in texts]

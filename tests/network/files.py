"""Topology files of two nodes, into which tests put one entry, and what is refused of them."""

from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.network.settings import NetworkSettings
from tieline.network.spec import Link, NetworkSpec
from tieline.network.topology import read_topology

SOURCES = [{"name": "pmu00", "bus": 1}]
DESTINATIONS = [{"name": "ctl00", "unit": "G1", "bus": 2}]
ENTRY_LINE = 4
"""The line of `two_nodes` on which its entry stands."""


def two_nodes(link: str = "", flow: str = "") -> str:
    """Return a file with further words of its one link, or with one cross flow."""
    head = (
        "link_defaults: {rate: 10 Mbit/s, queue: 50}\nnodes: {a: {buses: [1]}, b: {buses: [2]}}\n"
    )
    the_link = f"{{a: a, b: b, propagation: 1 ms{link and ', '}{link}}}"
    if flow:
        return f"{head}links: [{the_link}]\ncross_traffic: [{{from: a, to: b, {flow}}}]\n"
    return f"{head}links:\n  - {the_link}\n"


def read(folder: Path, text: str) -> NetworkSpec:
    """Return the network of a file with this text."""
    path = folder / "network.yaml"
    path.write_text(text, encoding="utf-8")
    return read_topology(path, SOURCES, DESTINATIONS, NetworkSettings())


def link_with(folder: Path, words: str) -> Link:
    """Return the link whose entry has these further words."""
    return read(folder, two_nodes(words)).links[0]


def refused(folder: Path, text: str) -> str:
    """Return the one finding of a file, which must name the line of the entry, without that."""
    with pytest.raises(InputError) as caught:
        read(folder, text)
    (finding,) = caught.value.findings
    start = f"{folder}/network.yaml:{ENTRY_LINE}: "
    assert finding.startswith(start)
    return finding.removeprefix(start)

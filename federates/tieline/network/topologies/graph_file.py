"""Reads GraphML and GML files, those of the Internet Topology Zoo among them, into plain facts."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import networkx as nx

from tieline.errors import InputError

MOST_BPS = 1e13
"""The rate that a topology file allows a link at most, bits a second."""

SUFFIXES = (".graphml", ".gml")

_LABEL_RATE = re.compile(
    r"(\d+(?:[.,]\d+)?)\s*([kmgt])(?:b(?:it)?(?:p|/)?s?|bps)?\b", re.IGNORECASE
)
_FACTOR = {"k": 1e3, "m": 1e6, "g": 1e9, "t": 1e12}
_HIERARCHY = {
    "e1": 2_048_000, "e3": 34_368_000, "t1": 1_544_000, "ds1": 1_544_000, "t3": 44_736_000,
    "ds3": 44_736_000,
}  # fmt: skip
"""Bits a second of plesiochronous links: ITU-T G.702."""

_SYNCHRONOUS = re.compile(r"\b(oc|stm)-?\s?(\d+)", re.IGNORECASE)
_SYNCHRONOUS_BPS = {"oc": 51_840_000, "stm": 155_520_000}
"""Bits a second of OC-1 and STM-1: ITU-T G.707."""


@dataclass(frozen=True)
class FileNode:
    """A node of a file; the place in degrees, or None where the file has none."""

    key: str
    label: str
    degrees: tuple[float, float] | None
    is_internal: bool


@dataclass(frozen=True)
class FileEdge:
    """An edge of a file between two keys; the rate in bits a second, or None if it is not said."""

    start: str
    end: str
    rate_bps: int | None


@dataclass(frozen=True)
class FileGraph:
    """What a file says; `is_directed` where an edge counts one way only."""

    path: Path
    nodes: tuple[FileNode, ...]
    edges: tuple[FileEdge, ...]
    is_directed: bool


def read_graph(path: Path) -> FileGraph:
    """Return the nodes and edges of a GraphML or GML file.

    Attributes that are read: Latitude and Longitude, degrees, label and Internal (0 for a node of
    another network) of nodes; LinkSpeedRaw, bits a second, and LinkLabel, such as `2.5 Gbps`,
    `STM-16` or `OC-48`, of edges.

    Raises:
        InputError: the file cannot be read, is of neither kind, is malformed, has no node, or has
            a place or a rate that is none; every finding.
    """
    graph = _parsed(path)
    findings: list[str] = []
    nodes = tuple(_node(key, data, path, findings) for key, data in graph.nodes(data=True))
    edges = tuple(
        FileEdge(str(start), str(end), _rate_bps(data, f"{path}: edge {start}-{end}", findings))
        for start, end, data in graph.edges(data=True)
    )
    if not nodes:
        findings.append(f"{path}: holds no node")
    if findings:
        raise InputError(findings)
    return FileGraph(path, nodes, edges, graph.is_directed())


def rate_of_label(label: str) -> int | None:
    """Return the bits a second that a link's label tells, or None if it tells none."""
    synchronous = _SYNCHRONOUS.search(label)
    if synchronous:
        return _SYNCHRONOUS_BPS[synchronous[1].lower()] * int(synchronous[2])
    for word in re.findall(r"\w+", label.lower()):
        if word in _HIERARCHY:
            return _HIERARCHY[word]
    found = _LABEL_RATE.search(label)
    if found is None:
        return None
    return round(float(found[1].replace(",", ".")) * _FACTOR[found[2].lower()])


def _parsed(path: Path) -> Any:
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: must be a file in {' or '.join(SUFFIXES)} (got '{path.suffix}')")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start})") from error
    try:
        if path.suffix.lower() == ".graphml":
            return nx.parse_graphml(text)
        # Files of the Zoo have parallel edges without saying so, which networkx insists on.
        if not re.search(r"^\s*multigraph\s+1", text, re.MULTILINE):
            text = re.sub(r"\bgraph\s*\[", "graph [\n multigraph 1", text, count=1)
        return nx.parse_gml(text, label="id")
    except ParseError as error:
        raise InputError(f"{path}:{error.position[0]}: is no XML ({error})") from error
    except (nx.NetworkXError, KeyError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"{path}: is no {path.suffix[1:]} that can be read ({error})") from error


def _node(key: Any, data: Mapping[str, Any], path: Path, findings: list[str]) -> FileNode:
    label = " ".join(str(data.get("label", "")).split()) or f"node {key}"
    place = _place(data, f"{path}: node '{label}'", findings)
    return FileNode(str(key), label, place, str(data.get("Internal", 1)) not in ("0", "0.0"))


def _place(data: Mapping[str, Any], where: str, findings: list[str]) -> tuple[float, float] | None:
    given = (data.get("Latitude"), data.get("Longitude"))
    if any(value is None or value == "" for value in given):
        return None
    try:
        latitude, longitude = float(given[0] or 0), float(given[1] or 0)
    except (TypeError, ValueError):
        latitude = longitude = float("nan")
    if not (abs(latitude) <= 90 and abs(longitude) <= 360):
        findings.append(
            f"{where}: Latitude must be from -90 to 90 and Longitude from -360 to 360 degrees "
            f"(got {given[0]!r} and {given[1]!r})"
        )
        return None
    return latitude, longitude


def _rate_bps(data: Mapping[str, Any], where: str, findings: list[str]) -> int | None:
    raw = data.get("LinkSpeedRaw")
    if raw is None or raw == "":
        return rate_of_label(str(data.get("LinkLabel", "")))
    try:
        rate = float(raw)
    except (TypeError, ValueError):
        rate = float("nan")
    if not 0 <= rate <= MOST_BPS:
        findings.append(
            f"{where}: LinkSpeedRaw must be from 0, unknown, to {MOST_BPS:g} bit/s (got {raw!r})"
        )
        return None
    # Zero stands for a speed that nobody knows.
    return round(rate) or rate_of_label(str(data.get("LinkLabel", "")))

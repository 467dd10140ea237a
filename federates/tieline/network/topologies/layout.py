"""Places nodes that have no coordinates, so that distances on paper are like those along links."""

from collections.abc import Sequence

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from tieline.network.topologies.places import distances_km
from tieline.network.topologies.stations import Corridor

Floats = NDArray[np.float64]

MOST_FOR_SPRINGS = 400
"""Nodes up to which springs of Kamada and Kawai take seconds at most."""


def layout(
    names: Sequence[str], corridors: Sequence[Corridor], upward: Sequence[str] = ()
) -> Floats:
    """Return (n, 2) positions whose mean distance is that along the corridors.

    A Kamada-Kawai layout; for more than `MOST_FOR_SPRINGS` nodes classical scaling, which needs no
    iteration.

    Args:
        names: of the nodes.
        corridors: they join all nodes.
        upward: nodes whose middle shall be above the middle of all.
    """
    if len(names) < 2:
        return np.zeros((len(names), 2))
    km = distances_km(names, corridors)
    xy = _springs(names, km) if len(names) <= MOST_FOR_SPRINGS else _scaled(km)
    xy = xy - xy.mean(axis=0)
    xy *= km.sum() / _apart(xy).sum()
    place = {name: i for i, name in enumerate(names)}
    up = xy[[place[name] for name in upward]].mean(axis=0) if upward else np.zeros(2)
    size = float(np.hypot(up[0], up[1]))
    if size == 0:
        return xy
    sin, cos = up / size
    return np.asarray(xy @ np.array([[cos, sin], [-sin, cos]]), np.float64)


def _springs(names: Sequence[str], km: Floats) -> Floats:
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(names)
    rows = {a: {b: float(km[i, j]) for j, b in enumerate(names)} for i, a in enumerate(names)}
    found = nx.kamada_kawai_layout(graph, dist=rows)
    return np.array([found[name] for name in names], np.float64)


def _scaled(km: Floats) -> Floats:
    """Return the positions by classical scaling: W. S. Torgerson, Psychometrika 17 (1952)."""
    squared = km**2
    centred = squared - squared.mean(axis=0) - squared.mean(axis=1)[:, None] + squared.mean()
    values, vectors = np.linalg.eigh(-0.5 * centred)
    return np.asarray(vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0)), np.float64)


def _apart(xy: Floats) -> Floats:
    offset = xy[:, None, :] - xy[None, :, :]
    return np.asarray(np.hypot(offset[..., 0], offset[..., 1]), np.float64)

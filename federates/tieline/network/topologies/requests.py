"""Turns what a command was told into settings, and refuses what does not fit together."""

import math
from collections.abc import Mapping
from typing import Any

from tieline.errors import InputError
from tieline.network.queues.drop_tail import MOST_PACKETS
from tieline.network.topologies.centres import Traffic
from tieline.network.topologies.draft import LinkDefaults
from tieline.network.topologies.hierarchical import Rates
from tieline.network.topologies.importing import MISSING, ImportOptions
from tieline.network.topologies.options import KINDS, Options
from tieline.problems import near
from tieline.units import quantity, seconds_to_ns

KIND_OF: Mapping[str, str] = {
    "hub": "star",
    "degree": "mesh",
    "regions": "hierarchical",
    "ring-size": "hierarchical",
    "core": "hierarchical",
    "core-rate": "hierarchical",
    "regional-rate": "hierarchical",
    "control-centres": "hierarchical",
    "cross-traffic": "hierarchical",
}
"""The kind of topology that reads an option."""

SPACING_KM = 50.0

_BOUNDS = {
    "rate": (1.0, 1e13, "1 bit/s to 10,000 Gbit/s"),
    "time": (0.0, 10.0, "0 to 10 s"),
    "length": (0.0, 100e3 * 1e3, "0 to 100,000 km"),
}


def link_defaults(
    rate: str, queue: int, overhead: int, propagation: str | None, distance: str | None
) -> LinkDefaults:
    """Return what holds for every link.

    Raises:
        InputError: a value out of its bounds, or both a propagation and a distance.
    """
    if not 1 <= queue <= MOST_PACKETS:
        raise InputError(f"--queue must be from 1 to {MOST_PACKETS} packets (got {queue})")
    if not 0 <= overhead <= 1000:
        raise InputError(f"--overhead must be from 0 to 1000 bytes (got {overhead})")
    if propagation is not None and distance is not None:
        raise InputError("--propagation and --distance do not go together: give one of them")
    time_s = _quantity("propagation", propagation, "time")
    length_m = _quantity("distance", distance, "length")
    return LinkDefaults(
        rate_bps=_rate("rate", rate) or 0,
        queue=queue,
        overhead_bytes=overhead,
        propagation_ns=None if time_s is None else seconds_to_ns(time_s),
        km=None if length_m is None else length_m / 1e3,
    )


def options(kind: str, links: LinkDefaults, told: Mapping[str, Any]) -> Options:
    """Return the options of a kind of topology.

    Args:
        kind: as the user wrote it.
        links: what holds for every link.
        told: value of each option of `KIND_OF`, None where it was not given.

    Raises:
        InputError: there is no such kind, or it does not read an option that was given.
    """
    if kind not in KINDS:
        raise InputError(f"no kind '{kind}'{near(kind, KINDS)} (allowed: {', '.join(KINDS)})")
    findings = [
        f"--{name} belongs to {KIND_OF[name]}: {kind} does not read it"
        for name, value in told.items()
        if value is not None and KIND_OF[name] != kind
    ]
    if findings:
        raise InputError(findings)
    return Options(
        links=links,
        hub=told["hub"],
        degree=told["degree"],
        regions=told["regions"],
        ring_size=told["ring-size"],
        core=told["core"] or "ring",
        rates=Rates(
            _rate("core-rate", told["core-rate"]), _rate("regional-rate", told["regional-rate"])
        ),
        has_centres=bool(told["control-centres"]),
        traffic=Traffic() if told["cross-traffic"] else None,
    )


def generated_size(
    case: str | None, nodes: int | None, seed: int | None, spacing: str | None
) -> tuple[int, int, float] | None:
    """Return nodes, seed and spacing, km, of a generated network; None for that of a case.

    Raises:
        InputError: neither a case nor a size or both, or a value out of its bounds.
    """
    if (case is None) == (nodes is None):
        raise InputError("give either a case or --nodes, the size of a generated network")
    if nodes is None:
        for name, value in (("seed", seed), ("spacing", spacing)):
            if value is not None:
                raise InputError(f"--{name} needs --nodes: nothing is random with a case")
        return None
    if seed is not None and seed < 0:
        raise InputError(f"--seed must be 0 or more (got {seed})")
    spacing_m = _quantity("spacing", spacing, "length")
    spacing_km = SPACING_KM if spacing_m is None else spacing_m / 1e3
    if spacing_km < 0.1:
        raise InputError(f"--spacing must be 0.1 km or more (got {spacing})")
    return nodes, 1 if seed is None else seed, spacing_km


def import_options(
    links: LinkDefaults, factor: float, missing: str, external: bool, largest: bool
) -> ImportOptions:
    """Return how a graph is imported.

    Raises:
        InputError: a value that is not allowed.
    """
    if not (math.isfinite(factor) and 1 <= factor <= 10):
        raise InputError(f"--factor must be from 1 to 10 (got {factor:g})")
    if missing not in MISSING:
        raise InputError(
            f"--missing must be {', '.join(MISSING[:-1])} or {MISSING[-1]} (got '{missing}')"
        )
    return ImportOptions(links, factor, external, missing, largest)


def refuse_assignment(case: str | None, has_table: bool, is_even: bool) -> None:
    """Raise InputError unless a case comes with just one way to assign its buses."""
    if case is None and (has_table or is_even):
        raise InputError("--buses and --spread assign the buses of a case: give --case, too")
    if case is not None and has_table == is_even:
        raise InputError(
            "--case needs to know where its buses stand: give either --buses CSV, with the columns "
            "bus and node, or --spread"
        )


def _rate(name: str, text: str | None) -> int | None:
    value = _quantity(name, text, "rate")
    return None if value is None else round(value)


def _quantity(name: str, text: str | None, dimension: str) -> float | None:
    if text is None:
        return None
    try:
        value = quantity(text, dimension)
    except ValueError as error:
        raise InputError(f"--{name} {error}") from error
    low, high, allowed = _BOUNDS[dimension]
    if not low <= value <= high:
        raise InputError(f"--{name} must be from {allowed} (got '{text}')")
    return value

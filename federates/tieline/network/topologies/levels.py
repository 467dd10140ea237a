"""Puts a hierarchical topology together: regions, levels, control centres and their traffic."""

from collections.abc import Sequence

from tieline.errors import InputError
from tieline.network.spec import Node
from tieline.network.topologies.centres import CITY_KM, control_centres, traffic_of
from tieline.network.topologies.constants import PREFIX
from tieline.network.topologies.draft import Draft, DraftCross, DraftLink
from tieline.network.topologies.hierarchical import Region, halved, hierarchical, regions_of
from tieline.network.topologies.options import CORES, Options
from tieline.network.topologies.places import DETOUR, Places
from tieline.network.topologies.shared_risk import severing_corridors
from tieline.network.topologies.write import as_rate

Group = tuple[str, Sequence[int]]
"""Name and members of a region."""

NODES_PER_REGION = 100


def levels(
    places: Places,
    nodes: tuple[Node, ...],
    areas: Sequence[Group] | None,
    options: Options,
    head: tuple[str, ...],
) -> Draft:
    """Return a hierarchical topology.

    Args:
        places: of the substations.
        nodes: the substations.
        areas: the regions unless `options.regions` asks for others; None where there are none.
        options: what it can be told.
        head: sentences to begin with.

    Raises:
        InputError: an option that is not allowed.
    """
    _refuse(options, len(nodes))
    regions = regions_of(places, _groups(places, areas, options), options.ring_size)
    links = hierarchical(places, regions, options.core, options.rates, options.links)
    sentences = [*head, _regions_text(places, regions), _links_text(options)]
    cross: tuple[DraftCross, ...] = ()
    if options.has_centres:
        centres, more = control_centres(places, regions, options.links, options.rates.core_bps)
        nodes, links = (*nodes, *centres), (*links, *more)
        sentences.append(
            f"control centres: {PREFIX}... of each region, {CITY_KM:g} km from its first gateway "
            "(chosen), with a link of the core's rate to either gateway; the one to the second "
            "gateway is as much longer as that is farther off. In x and y it stands off the first."
        )
    if options.traffic is not None:
        cross = traffic_of(places, regions, options.traffic)
        sentences.append(
            f"cross_traffic: CBR of {as_rate(options.traffic.telemetry_bps)} from each substation "
            "to its region's control centre, measurements and video; Poisson of "
            f"{as_rate(options.traffic.data_bps)} between control centres of regions next to each "
            "other in the core, either way, planning data and many users. Rates count payload, UDP "
            "and IPv4 headers; all are chosen."
        )
    if places.has_corridors and len(nodes) > 2:
        sentences.append(_cuts_text([node.name for node in nodes], links))
    return Draft(tuple(sentences), options.links, nodes, links, cross)


def _refuse(options: Options, count: int) -> None:
    findings = []
    if options.core not in CORES:
        findings.append(f"--core must be {' or '.join(CORES)} (got '{options.core}')")
    if options.regions is not None and not 1 <= options.regions <= count:
        findings.append(f"--regions must be from 1 to {count} nodes (got {options.regions})")
    if options.ring_size is not None and options.ring_size < 3:
        findings.append(f"--ring-size must be 3 or more (got {options.ring_size})")
    if options.traffic is not None and not options.has_centres:
        findings.append("--cross-traffic is that of control centres: give --control-centres, too")
    if findings:
        raise InputError(findings)


def _groups(places: Places, areas: Sequence[Group] | None, options: Options) -> Sequence[Group]:
    if areas is not None and options.regions is None:
        return areas
    count = len(places.names)
    wanted = options.regions or max(1, round(count / NODES_PER_REGION))
    parts = halved(places, range(count), wanted)
    width = len(str(wanted))
    return [(f"R{i:0{width}d}", part) for i, part in enumerate(parts, 1)]


def _regions_text(places: Places, regions: Sequence[Region]) -> str:
    if len(regions) > 12:
        return f"regions: {len(regions)}."
    each = [
        f"{region.name} ({len(region.members)} substations, gateways "
        f"{' and '.join(places.names[at] for at in dict.fromkeys(region.gateways))})"
        for region in regions
    ]
    return f"regions: {', '.join(each)}."


def _links_text(options: Options) -> str:
    rates = options.rates
    of_level = [
        f"{name} {as_rate(rate or options.links.rate_bps)}"
        for name, rate in (
            ("core", rates.core_bps),
            ("regional", rates.regional_bps),
            ("access", rates.access_bps),
        )
    ]
    shape = "a ring" if options.core == "ring" else "a mesh of all pairs"
    return (
        f"links: {shape} joins the first gateways of all regions, a second ring the second "
        "gateways; a ring runs through the routers of each region, both gateways among them: the "
        "substations nearest to all others; every other substation "
        "has a link to each of two ring routers. Both links of a substation, both planes of the "
        f"core and the links of a ring keep out of each other's corridors where a detour of up to "
        f"{DETOUR:g} km saves a km of sharing (chosen). Rates: "
        f"{', '.join(of_level)} (chosen)."
    )


def _cuts_text(names: Sequence[str], links: Sequence[DraftLink]) -> str:
    cuts = severing_corridors(names, links)
    each = [f"{a}-{b} ({', '.join(lost)})" for (a, b), lost in cuts.items()]
    return (
        "redundancy: every node has two ways to every other that share no link and no node "
        "between. Links share corridors, though: "
        + (
            f"a cut corridor parts these stations from the rest: {', '.join(each)}."
            if each
            else "but no single cut corridor parts any station from the rest."
        )
    )

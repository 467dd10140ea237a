"""What the generators of topologies can be told."""

from dataclasses import dataclass, field

from tieline.network.topologies.centres import Traffic
from tieline.network.topologies.draft import LinkDefaults
from tieline.network.topologies.hierarchical import Rates

KINDS = ("star", "ring", "mesh", "hierarchical", "along-lines")

CORES = ("ring", "mesh")


@dataclass(frozen=True)
class Options:
    """Every option; each kind of topology reads what concerns it.

    Attributes:
        links: what holds for every link.
        hub: of a star.
        degree: of a mesh, or None for 3, as far as there are so many others.
        regions: of a hierarchical network, or None for a case's areas or `nodes_per_region`.
        ring_size: routers in each regional ring, or None for the square root of the members.
        core: one of `CORES`.
        rates: of the levels of a hierarchical network.
        has_centres: whether each region has a control centre.
        traffic: what the control centres cause, or None.
    """

    links: LinkDefaults = field(default_factory=LinkDefaults)
    hub: str | None = None
    degree: float | None = None
    regions: int | None = None
    ring_size: int | None = None
    core: str = "ring"
    rates: Rates = field(default_factory=Rates)
    has_centres: bool = False
    traffic: Traffic | None = None

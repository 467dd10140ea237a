"""Kinds of background traffic, one a file; `TRAFFIC` are the names that a topology file may use."""

from tieline.network.entry import Entry
from tieline.network.traffic.base import HEADER_BYTES, IP_HEADER, UDP_HEADER, FlowEntry, Traffic
from tieline.network.traffic.cbr import Cbr, CbrEntry
from tieline.network.traffic.files import Files, FilesEntry
from tieline.network.traffic.flood import FloodEntry
from tieline.network.traffic.greedy import Greedy, GreedyEntry
from tieline.network.traffic.on_off import OnOff, OnOffEntry
from tieline.network.traffic.poisson import Poisson, PoissonEntry
from tieline.network.traffic.polling import Polling, PollingEntry
from tieline.network.traffic.trace import Trace, TraceEntry

__all__ = [
    "HEADER_BYTES",
    "IP_HEADER",
    "TRAFFIC",
    "UDP_HEADER",
    "Cbr",
    "Files",
    "FlowEntry",
    "Greedy",
    "OnOff",
    "Poisson",
    "Polling",
    "Trace",
    "Traffic",
]

TRAFFIC: dict[str, type[Entry]] = {
    "cbr": CbrEntry,
    "poisson": PoissonEntry,
    "on_off": OnOffEntry,
    "files": FilesEntry,
    "trace": TraceEntry,
    "polling": PollingEntry,
    "greedy": GreedyEntry,
    "flood": FloodEntry,
}

"""What each federate tells HELICS of itself, as the JSON that HELICS itself reads."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tieline.cosim.guests import MODULATION, PACKETS, GuestSettings, endpoint_of, guests_of
from tieline.cosim.interfaces import ENDPOINTS, FEDERATES, GRID, NETWORK, Clock
from tieline.units import ns_to_seconds

BROKER_NAME = "tieline"
LOOPBACK = "127.0.0.1"
# A tick of 500 ms with a timeout of 2 s notices a lost peer in 2 to 3 s; the defaults take half a
# minute.
WATCHFUL = "--tick=500ms --timeout=2s --loglevel=warning"

_OWN_ENDPOINTS = {GRID: MODULATION, NETWORK: PACKETS}


@dataclass(frozen=True)
class Place:
    """Where the federation meets.

    Attributes:
        core: `zmq`, `tcp` or `inproc`.
        port: where the broker listens; None for inproc.
        host: the broker's address.
        interface: address of this host at which others reach it.
    """

    core: str
    port: int | None = None
    host: str = LOOPBACK
    interface: str = LOOPBACK


def member_count(run: Mapping[str, Any]) -> int:
    """Return how many federates the broker waits for."""
    return len(FEDERATES) + len(guests_of(run))


def broker_options(place: Place, members: int) -> str:
    """Return how a broker for `members` federates is told where to listen."""
    where = "" if place.port is None else f" --port={place.port} --local_interface={place.host}"
    return f"--federates={members}{where}{_reuse(place)} {WATCHFUL}"


def core_options(place: Place, connect_s: float) -> str:
    """Return how a core finds the broker, for at most `connect_s` seconds."""
    options = f"--federates=1 {WATCHFUL} --networktimeout={round(connect_s * 1e3)}ms"
    if place.port is None:
        return f"{options} --broker={BROKER_NAME}"
    where = f"--brokeraddress={place.host} --brokerport={place.port}"
    # On loopback HELICS finds its own way, and is left the one that it was measured on.
    own = "" if place.interface == LOOPBACK else f" --local_interface={place.interface}"
    return f"{options} {where}{own}{_reuse(place)}"


def _reuse(place: Place) -> str:
    # Else a tcp port stays taken for a minute after a run: Linux keeps ended connections so long.
    return " --reuse_address" if place.core == "tcp" else ""


def federate_config(
    name: str, place: Place, connect_s: float, endpoints: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return a federate's HELICS configuration; the time contract rests on its flags."""
    return {
        "name": name,
        "core_type": place.core,
        "core_init_string": core_options(place, connect_s),
        "uninterruptible": True,
        "time_delta": "1ns",
        "endpoints": [dict(endpoint) for endpoint in endpoints],
    }


def own_config(name: str, run: Mapping[str, Any], place: Place, connect_s: float) -> dict[str, Any]:
    """Return the configuration of the grid or the network; guests add an endpoint for them."""
    names = [ENDPOINTS[name]]
    if any(guest.units for guest in guests_of(run)):
        names.append(_OWN_ENDPOINTS[name])
    endpoints = [{"name": endpoint, "global": True} for endpoint in names]
    return federate_config(name, place, connect_s, endpoints)


def guest_config(
    guest: GuestSettings, run: Mapping[str, Any], place: Place, connect_s: float
) -> dict[str, Any]:
    """Return a guest's configuration; under `tieline` stands what HELICS need not know.

    There, `rate_hz` and `intervals` give the instants t_k, `stop_s` the last of them, `pmus` the
    bus of each frame's IDCODE.
    """
    endpoints = [
        {"name": endpoint_of(guest.name, unit), "global": True, "destination": MODULATION}
        for unit in guest.units
    ]
    clock = Clock(**run["clock"])
    facts = {
        "rate_hz": clock.rate_hz,
        "intervals": clock.intervals,
        "stop_s": ns_to_seconds(clock.at_ns(clock.intervals)),
        "pmus": {str(i): source["bus"] for i, source in enumerate(run.get("sources", ()), 1)},
        "units": list(guest.units),
        "limit": guest.limit,
    }
    return federate_config(guest.name, place, connect_s, endpoints) | {"tieline": facts}

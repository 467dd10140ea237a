"""IPv4 addresses and host routes with which every flow takes exactly its own route."""

from dataclasses import dataclass

from tieline.network.spec import NetworkSpec, Route


@dataclass(frozen=True)
class Address:
    """An address of a node, and by which port (number) each other node sends towards it."""

    node: str
    next_port: dict[str, int]


def routes_of(spec: NetworkSpec) -> list[Route]:
    """Return the routes of the PMU flows, then those of the cross flows."""
    return [flow.route for flow in spec.flows] + [flow.route for flow in spec.cross_flows]


def addressed(spec: NetworkSpec) -> tuple[list[Address], list[int]]:
    """Return the addresses, and the number of the address that each flow sends to.

    IP forwards by destination alone. Flows to one node share an address as long as no node would
    have to forward them differently; a flow that does not fit gets another address of that node.
    PMU flows come first, then cross flows.
    """
    addresses: list[Address] = []
    of_node: dict[str, list[int]] = {}
    numbers = []
    for route in routes_of(spec):
        node = route[-1]
        ports = {at: port for at, (port, _) in zip(route, spec.hops(route), strict=False)}
        own = of_node.setdefault(node, [])
        number = next((n for n in own if _agree(addresses[n].next_port, ports)), None)
        if number is None:
            number = len(addresses)
            addresses.append(Address(node, {}))
            own.append(number)
        addresses[number].next_port.update(ports)
        numbers.append(number)
    return addresses, numbers


def _agree(one: dict[str, int], other: dict[str, int]) -> bool:
    return all(one.get(node, port) == port for node, port in other.items())

"""The ns-3 network simulator behind the engine protocol."""

from tieline.network.ns3.engine import Ns3Engine

__all__ = ["Ns3Engine"]

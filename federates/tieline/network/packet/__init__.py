"""tieline's discrete-event packet engine."""

from tieline.network.packet.engine import PacketEngine

__all__ = ["PacketEngine"]

"""What became of single packets of a result."""

from tieline.fates.lookup import Asked, Found, packet_fate
from tieline.fates.text import show

__all__ = ["Asked", "Found", "packet_fate", "show"]

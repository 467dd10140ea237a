"""A flooding attack: a great rate of small datagrams, from a stated time on."""

from typing import Literal

from pydantic import Field

from tieline.network.traffic.base import FlowEntry, Payload, Rate, Traffic
from tieline.network.traffic.poisson import Poisson
from tieline.units import Seconds


class FloodEntry(FlowEntry):
    """A flooding attack: Poisson traffic with a start that must be stated."""

    kind: Literal["flood"] = Field(description="which traffic this is")
    rate: Rate
    payload: Payload = 18
    start: Seconds = Field(ge=0, le=1e6, description="when it begins")

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Poisson(self.rate, self.payload)

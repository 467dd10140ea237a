"""What an experiment says about the packet network."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictFloat

from tieline.network.queues import QueueEntry
from tieline.network.spec import Transport
from tieline.units import Seconds


class NetworkSettings(BaseModel):
    """The engine that carries the frames, and what the experiment changes of its topology."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    engine: Literal["ideal", "constant", "packet"] = Field(
        "packet",
        description="ideal: no delay; constant: one delay for all; packet: a simulated network",
    )
    delay: Seconds | None = Field(
        None, ge=0, le=10, description="combined delay of the constant engine, s"
    )
    topology: str = Field(
        "case", description="'case' for the case's own network.yaml, or the path of a topology file"
    )
    mean_delay: Seconds | None = Field(
        None,
        gt=0,
        le=10,
        description=(
            "mean combined delay that the packet engine's processing times are lengthened to, s; "
            "none leaves the topology as it is"
        ),
    )
    loss: StrictFloat | None = Field(
        None,
        ge=0,
        lt=1,
        description="loss probability of each link, in place of the topology's own",
    )
    cross_traffic: StrictFloat = Field(
        1.0, ge=0, le=20, description="factor on the rate of all cross traffic; 0 turns it off"
    )
    queue: QueueEntry | None = Field(
        None, description="queue of each link, in place of the topology's own"
    )
    transport: Transport | None = Field(
        None,
        description=(
            "how frames travel, in place of the topology's own: unicast (a UDP packet to each "
            "controller), multicast (one along a tree), tcp (a connection to each)"
        ),
    )
    dscp: int | None = Field(
        None, ge=0, le=63, strict=True, description="mark of frames, in place of the topology's own"
    )
    traffic: tuple[dict[str, Any], ...] = Field(
        (), description="cross traffic besides the topology's own, in the words of its file"
    )
    events: tuple[dict[str, Any], ...] = Field(
        (), description="what happens to links besides the topology's own events"
    )
    capture: tuple[tuple[str, str], ...] = Field(
        (), description="links (pairs of nodes) whose packets are written to capture files"
    )
    record_packets: StrictBool = Field(False, description="write packets.parquet, one row a packet")

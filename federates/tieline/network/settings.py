"""What an experiment says about the packet network."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictFloat

from tieline.units import Seconds

PACKET_ENGINES = ("packet", "ns3")
"""The engines that simulate every packet of a topology."""


class NetworkSettings(BaseModel):
    """The engine that carries the frames, and what the experiment changes of its topology."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    engine: Literal["ideal", "constant", "packet", "ns3"] = Field(
        "packet",
        description=(
            "ideal: no delay; constant: one delay for all; packet: a simulated network; "
            "ns3: the same network in the ns-3 simulator, which is an extra of its own"
        ),
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
            "mean combined delay that the PMUs' processing times are lengthened to, s; "
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
    record_packets: StrictBool = Field(False, description="write packets.parquet, one row a packet")

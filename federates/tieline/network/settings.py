"""What an experiment says about the packet network."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictFloat, model_validator

from tieline.network.entry import InTheWordsOf
from tieline.network.queues import QueueEntry
from tieline.network.schema import EventEntry, JitterEntry
from tieline.network.spec import Transport
from tieline.network.traffic import TRAFFIC
from tieline.units import Seconds, Share, Unit

PACKET_ENGINES = ("packet", "ns3")
"""The engines that simulate every packet of a topology."""

MAX_DELAY_S = 10.0
"""Longest delay that a setting or a trace may have, s."""

Flow = Annotated[dict[str, Any], InTheWordsOf(tuple(TRAFFIC.values()))]
LinkEvent = Annotated[dict[str, Any], InTheWordsOf((EventEntry,))]
"""Checked together with the topology's own, when the topology is read."""


class PathSettings(BaseModel):
    """The delays of one path of the empirical engine."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    source: str = Field(
        min_length=1, description="the PMU, by name or bus", coerce_numbers_to_str=True
    )
    destination: str = Field(min_length=1, description="the controller, by name or unit")
    distribution: JitterEntry = Field(description="distribution of the delays")
    offset: Seconds = Field(0.0, ge=0, le=MAX_DELAY_S, description="time added to each delay")


class EmpiricalSettings(BaseModel):
    """Where the empirical engine takes the delay of each packet from."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    trace: str | None = Field(
        None,
        min_length=1,
        description=(
            "CSV file of measured delays: one column delay_s, or source, destination and delay_s"
        ),
    )
    draw: Literal["at_random", "in_turn"] = Field(
        "at_random", description="which measured delay a packet gets: any, or the next of its path"
    )
    distribution: JitterEntry | None = Field(
        None, description="distribution of the delays of all paths, in place of a trace"
    )
    offset: Seconds = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="time added to each delay of the distribution"
    )
    paths: tuple[PathSettings, ...] = Field(
        (), description="paths with a distribution of their own, in place of that of all"
    )
    keep_order: StrictBool = Field(
        True, description="whether a packet never overtakes the one before it on its path"
    )

    @model_validator(mode="after")
    def _has_one_origin(self) -> "EmpiricalSettings":
        if (self.trace is None) == (self.distribution is None):
            raise ValueError("must have either a 'trace' or a 'distribution'")
        if self.trace is not None and (self.offset or self.paths):
            raise ValueError("'offset' and 'paths' go with a 'distribution', not with a 'trace'")
        return self


class NetworkSettings(BaseModel):
    """The engine that carries the frames, and what the experiment changes of its topology."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    engine: Literal["ideal", "constant", "empirical", "helics-filters", "packet", "ns3"] = Field(
        "packet",
        description=(
            "ideal: no delay; constant: one delay for all; empirical: drawn or measured delays; "
            "helics-filters: HELICS's own delay and random_drop; packet: a simulated network; ns3: "
            "the same network in the ns-3 simulator, which is an extra of its own"
        ),
    )
    delay: Seconds | None = Field(
        None,
        ge=0,
        le=10,
        description="combined delay of the engines constant and helics-filters",
    )
    topology: str = Field(
        "case",
        min_length=1,
        description=(
            "'case' for the case's own network.yaml, the name of another topology of the case, "
            "such as wan, or the path of a topology file"
        ),
    )
    mean_delay: Seconds | None = Field(
        None,
        gt=0,
        le=10,
        description=(
            "mean combined delay that the PMUs' processing times are lengthened to; "
            "none leaves the topology as it is"
        ),
    )
    loss: Share | None = Field(
        None,
        ge=0,
        lt=1,
        description=(
            "loss probability of each link, in place of the topology's own; without links, of each "
            "packet"
        ),
    )
    jitter: JitterEntry | None = Field(
        None,
        description=(
            "random delay that each link adds to each packet, in place of the topology's own"
        ),
    )
    cross_traffic: Annotated[StrictFloat, Unit("1")] = Field(
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
    dscp: Annotated[int, Unit("number")] | None = Field(
        None,
        ge=0,
        le=63,
        strict=True,
        description="differentiated services mark of frames, in place of the topology's own",
    )
    traffic: tuple[Flow, ...] = Field(
        (), description="cross traffic besides the topology's own, in the words of its file"
    )
    events: tuple[LinkEvent, ...] = Field(
        (), description="what happens to links besides the topology's own events"
    )
    convergence: Seconds | None = Field(
        None,
        ge=0,
        le=1e4,
        description="time until routes follow a failure, in place of the topology's own",
    )
    capture: tuple[tuple[str, str], ...] = Field(
        (), description="links (pairs of nodes) whose packets are written to capture files"
    )
    empirical: EmpiricalSettings | None = Field(
        None, description="where the empirical engine takes its delays from"
    )
    record_packets: StrictBool = Field(
        False, description="whether packets.parquet is written, one row a packet"
    )
    series_window: Seconds | None = Field(
        0.1,
        ge=1e-3,
        le=10,
        description=(
            "length of the windows of link_series.parquet and controller_series.parquet; none "
            "writes neither"
        ),
    )

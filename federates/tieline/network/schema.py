"""What a topology file may say: one pydantic model for each kind of entry."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from tieline.network.entry import Entry
from tieline.network.framing import FRAMINGS, MPLS_LABEL_BYTES
from tieline.network.jitter import JITTERS, JitterEntry
from tieline.network.losses import LOSSES, Bernoulli, Loss, LossEntry
from tieline.network.queues import QUEUES, DropTail, Queue, QueueEntry
from tieline.network.queues.drop_tail import MOST_PACKETS
from tieline.network.spec import Transport
from tieline.network.traffic import TRAFFIC
from tieline.units import BitsPerSecond, Bytes, Seconds, Share, Unit

TAGGED: dict[str, dict[str, type[Entry]]] = {
    "distribution": JITTERS,
    "model": LOSSES,
    "discipline": QUEUES,
    "kind": TRAFFIC,
}
"""The words by which entries of several kinds tell which they are."""


def _plain_or_mapping(value: Any) -> str:
    return "mapping" if isinstance(value, dict | Entry) else "plain"


PlainOrMapping = Discriminator(_plain_or_mapping)
"""Tells a number from a model with its parameters, so that each fault is told once."""

QueueOrLimit = Annotated[
    Annotated[int, Field(ge=1, le=MOST_PACKETS, strict=True), Unit("packets"), Tag("plain")]
    | Annotated[QueueEntry, Tag("mapping")],
    PlainOrMapping,
]
LossOrShare = Annotated[
    Annotated[Share, Field(ge=0, lt=1), Tag("plain")] | Annotated[LossEntry, Tag("mapping")],
    PlainOrMapping,
]


Kilometres = Annotated[float, Field(ge=-1e5, le=1e5), Unit("km")]


class NodeEntry(Entry):
    """A substation and its buses."""

    buses: list[Annotated[int, Field(strict=True), Unit("number")]] = Field(
        [], description="numbers of the buses whose devices are wired to it"
    )
    x: Kilometres | None = Field(None, description="place in drawings, to the east")
    y: Kilometres | None = Field(None, description="place in drawings, to the north")


class LinkDefaults(Entry):
    """What a link takes where its own entry is silent."""

    rate: BitsPerSecond | None = Field(
        None, ge=1, le=1e13, description="rate of either direction, the link layer's bytes included"
    )
    queue: QueueOrLimit | None = Field(
        None, description="packets that may wait at either end, or a queue discipline"
    )
    loss: LossOrShare | None = Field(
        None, description="probability that a packet is lost, or a loss model; none loses nothing"
    )
    jitter: JitterEntry | None = Field(
        None, description="random delay added to the propagation of each packet; none adds nothing"
    )
    overhead: Bytes | None = Field(
        None, ge=0, le=1000, description="bytes that the link layer adds to each packet; none: 0"
    )
    framing: Literal["ethernet", "ppp", "ppp_hdlc", "t1", "sonet"] | None = Field(
        None, description="the link layer by name, in place of overhead"
    )
    mpls_labels: Annotated[int, Unit("labels")] | None = Field(
        None, ge=0, le=16, strict=True, description="MPLS labels of 4 bytes on each packet; none: 0"
    )
    duplex: Literal["full", "half"] | None = Field(
        None, description="both ends at once, or one at a time; none: full"
    )
    mtu: Bytes | None = Field(
        None, ge=68, le=65_535, description="largest IP packet; none: that of Ethernet, 1500"
    )
    cost: Annotated[float, Unit("1")] | None = Field(
        None, gt=0, le=1e9, description="what routing by cost counts; none: 1"
    )

    @model_validator(mode="after")
    def _one_overhead(self) -> "LinkDefaults":
        if self.overhead is not None and self.framing is not None:
            raise ValueError("'overhead' and 'framing' say the same thing: give one of them")
        return self


class LinkEntry(LinkDefaults):
    """A link between two nodes."""

    a: str = Field(description="node at one end")
    b: str = Field(description="node at the other end")
    propagation: Seconds = Field(
        ge=0, le=10, description="from the last bit sent to the last bit received"
    )

    def filled(self, defaults: LinkDefaults) -> dict[str, Any]:
        """Return what links have in common, from the defaults where not given."""
        names = LinkDefaults.model_fields
        own = {name: getattr(self, name) for name in names}
        given = {
            name: getattr(defaults, name) if value is None else value for name, value in own.items()
        }
        # A link's own overhead, or framing, replaces whichever the defaults have.
        if self.overhead is not None:
            given["framing"] = None
        elif self.framing is not None:
            given["overhead"] = None
        return given


class PmuEntry(Entry):
    """The PMUs: time until a frame leaves, and how the frames travel."""

    processing: Seconds = Field(
        0.0, ge=0, le=10, description="from the measurement until its frame leaves"
    )
    jitter: JitterEntry | None = Field(
        None, description="random delay added to the processing of each frame"
    )
    transport: Transport = Field("unicast", description="how frames travel")
    dscp: Annotated[int, Unit("number")] = Field(
        0, ge=0, le=63, strict=True, description="differentiated services mark of frames"
    )


class ControllerEntry(Entry):
    """The controllers: time until they can use a frame."""

    processing: Seconds = Field(
        0.0, ge=0, le=10, description="from the arrival of a frame until it is used"
    )
    jitter: JitterEntry | None = Field(
        None, description="random delay added to the processing of each frame"
    )


class RoutingEntry(Entry):
    """How routes are found, and whether they are found again after a failure."""

    metric: Literal["delay", "hops", "cost"] = Field(
        "delay", description="what the shortest route is short in"
    )
    equal_cost: Literal["first", "split"] = Field(
        "first", description="whether flows take the first of equal routes, or are spread over them"
    )
    convergence: Seconds | None = Field(
        None,
        ge=0,
        le=1e4,
        description="from a failure or repair until routes follow; none: they never do",
    )


class RouteEntry(Entry):
    """A route that is fixed by hand."""

    origin: str = Field(alias="from", description="node that sends")
    target: str = Field(alias="to", description="node that receives")
    via: list[str] = Field([], description="nodes between them, in order")


class EventEntry(Entry):
    """Something that happens to links at a time, for a time or for good."""

    at: Seconds = Field(ge=0, le=1e6, description="instant at which it happens")
    lasts: Seconds | None = Field(
        None, alias="for", gt=0, le=1e6, description="time that it lasts; none: for good"
    )
    event: Literal["link_down", "node_down", "rate", "loss"] = Field(
        description="what happens: a link or a node fails, a rate changes, packets are lost"
    )
    link: list[str] | None = Field(
        None, min_length=2, max_length=2, description="the two nodes that the link joins"
    )
    node: str | None = Field(None, description="the node that fails")
    rate: BitsPerSecond | None = Field(
        None, ge=1, le=1e13, description="rate from then on, without the framing's share"
    )
    probability: Share | None = Field(
        None, gt=0, lt=1, description="probability of loss, on one link or on all"
    )

    @model_validator(mode="after")
    def _complete(self) -> "EventEntry":
        needs = {
            "link_down": ("link",),
            "node_down": ("node",),
            "rate": ("link", "rate"),
            "loss": ("probability",),
        }[self.event]
        missing = [name for name in needs if getattr(self, name) is None]
        if missing:
            raise ValueError(f"event '{self.event}' needs '{missing[0]}'")
        allowed = {*needs, "link"} if self.event == "loss" else set(needs)
        given = {"link", "node", "rate", "probability"} & self.model_fields_set
        if given - allowed:
            raise ValueError(f"event '{self.event}' takes no '{min(given - allowed)}'")
        return self


def overhead_of(given: dict[str, Any]) -> int:
    """Return the bytes that a link's layer adds to a packet."""
    labels = (given["mpls_labels"] or 0) * MPLS_LABEL_BYTES
    if given["framing"] is not None:
        return FRAMINGS[given["framing"]].overhead_bytes + labels
    return int(given["overhead"] or 0) + labels


def rate_of(given: dict[str, Any]) -> int:
    """Return the rate at which a link carries packets, bit/s."""
    share = 1.0 if given["framing"] is None else FRAMINGS[given["framing"]].share
    return max(1, round(given["rate"] * share))


def queue_of(given: Any) -> Queue:
    """Return a queue, of which a number is the packets that it holds."""
    queue: Queue = DropTail(given) if isinstance(given, int) else given.queue()
    return queue


def loss_of(given: Any) -> Loss | None:
    """Return a loss model, of which a number is the probability."""
    if given is None or given == 0:
        return None
    loss: Loss = Bernoulli(given) if isinstance(given, float | int) else given.loss()
    return loss


def allowed_keys(model: type[Entry]) -> list[str]:
    """Return the keys that an entry may have, as the file spells them."""
    return [field.alias or name for name, field in model.model_fields.items()]

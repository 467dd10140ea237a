"""What a topology file may say: one pydantic model for each kind of entry."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from tieline.network.jitter import GammaJitter, Jitter, NormalJitter, UniformJitter
from tieline.units import BitsPerSecond, Seconds, seconds_to_ns

MAX_QUEUE = 100_000


class Entry(BaseModel):
    """Refuses keys that it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class UniformEntry(Entry):
    """Equally likely between two ends."""

    distribution: Literal["uniform"]
    low: Seconds = Field(ge=0, le=10)
    high: Seconds = Field(ge=0, le=10)

    @model_validator(mode="after")
    def _ordered(self) -> "UniformEntry":
        if self.low > self.high:
            raise ValueError(f"'low' must not exceed 'high' ({self.low:g} s > {self.high:g} s)")
        return self

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return UniformJitter(seconds_to_ns(self.low), seconds_to_ns(self.high))


class NormalEntry(Entry):
    """A normal distribution cut to [0, 2 mean]."""

    distribution: Literal["normal"]
    mean: Seconds = Field(ge=1e-9, le=10)
    deviation: Seconds = Field(ge=1e-9, le=10)

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return NormalJitter(seconds_to_ns(self.mean), seconds_to_ns(self.deviation))


class GammaEntry(Entry):
    """A gamma distribution."""

    distribution: Literal["gamma"]
    mean: Seconds = Field(ge=1e-9, le=10)
    deviation: Seconds = Field(ge=1e-9, le=10)

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return GammaJitter(seconds_to_ns(self.mean), seconds_to_ns(self.deviation))


JITTERS: dict[str, type[Entry]] = {
    "uniform": UniformEntry,
    "normal": NormalEntry,
    "gamma": GammaEntry,
}
JitterEntry = Annotated[
    UniformEntry | NormalEntry | GammaEntry, Field(discriminator="distribution")
]


class NodeEntry(Entry):
    """A substation and its buses."""

    buses: list[Annotated[int, Field(strict=True)]] = Field(default_factory=list)
    x: float | None = None
    y: float | None = None


class LinkDefaults(Entry):
    """What a link takes where its own entry is silent."""

    rate: BitsPerSecond | None = Field(None, ge=1, le=1e13)
    queue: int | None = Field(None, ge=1, le=MAX_QUEUE, strict=True)
    loss: float | None = Field(None, ge=0, lt=1, strict=True)
    jitter: JitterEntry | None = None
    overhead: int | None = Field(None, ge=0, le=1000, strict=True)


class LinkEntry(LinkDefaults):
    """A link between two nodes."""

    a: str
    b: str
    propagation: Seconds = Field(ge=0, le=10)

    def filled(self, defaults: LinkDefaults) -> dict[str, Any]:
        """Return rate, queue, loss, jitter and overhead, from the defaults where not given."""
        names = LinkDefaults.model_fields
        own = {name: getattr(self, name) for name in names}
        return {
            name: getattr(defaults, name) if value is None else value for name, value in own.items()
        }


class ProcessingEntry(Entry):
    """The time that a device needs for a frame, and its jitter."""

    processing: Seconds = Field(0.0, ge=0, le=10)
    jitter: JitterEntry | None = None


class CrossEntry(Entry):
    """Background traffic between two nodes."""

    kind: Literal["cbr", "poisson"]
    origin: str = Field(alias="from")
    target: str = Field(alias="to")
    rate: BitsPerSecond = Field(ge=1, le=1e13)
    payload: int = Field(ge=1, le=65_000, strict=True)


def allowed_keys(model: type[Entry]) -> list[str]:
    """Return the keys that an entry may have, as the file spells them."""
    return [field.alias or name for name, field in model.model_fields.items()]

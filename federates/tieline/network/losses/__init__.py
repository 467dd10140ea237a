"""Models of loss on a link, one a file; `LOSSES` are the names that a topology file may use."""

from typing import Annotated

from pydantic import Field

from tieline.network.entry import Entry
from tieline.network.losses.base import Loss
from tieline.network.losses.bernoulli import Bernoulli, BernoulliEntry
from tieline.network.losses.bit_error import BitError, BitErrorEntry
from tieline.network.losses.gilbert_elliott import GilbertElliott, GilbertElliottEntry
from tieline.network.losses.trace import LossTrace

__all__ = [
    "LOSSES",
    "Bernoulli",
    "BitError",
    "GilbertElliott",
    "Loss",
    "LossEntry",
    "LossTrace",
]

LOSSES: dict[str, type[Entry]] = {
    "bernoulli": BernoulliEntry,
    "bit_error": BitErrorEntry,
    "gilbert_elliott": GilbertElliottEntry,
}
LossEntry = Annotated[
    BernoulliEntry | BitErrorEntry | GilbertElliottEntry, Field(discriminator="model")
]

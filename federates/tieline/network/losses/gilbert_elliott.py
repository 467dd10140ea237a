"""Losses in bursts: a good and a bad state, each with a loss probability of its own.

E. N. Gilbert, Capacity of a burst-noise channel, Bell System Technical Journal 39 (1960); E. O.
Elliott, Estimates of error rates for codes on burst-noise channels, the same 42 (1963). The state
may change after every packet.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from tieline.network.draws import CHUNK, NEVER, Chunk, Chunks, chunked
from tieline.network.entry import Entry
from tieline.network.losses.base import Loss
from tieline.units import Share

MOST_VISITS = 100_000
"""Visits to each state that are drawn at a time."""


@dataclass(frozen=True)
class GilbertElliott:
    """A Markov chain of two states, started in its stationary distribution.

    Attributes:
        to_bad, to_good: probability that the good state, or the bad one, ends with a packet.
        loss_good, loss_bad: probability that a packet is lost in either.
    """

    to_bad: float
    to_good: float
    loss_good: float = 0.0
    loss_bad: float = 1.0

    @property
    def counts(self) -> Literal["packets"]:
        """Packets."""
        return "packets"

    @property
    def share_bad(self) -> float:
        """The share of packets that meet the bad state."""
        return self.to_bad / (self.to_bad + self.to_good)

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps between losses."""
        return chunked(self._parts(generator), NEVER)

    def share(self, link_bytes: int) -> float:
        """Return the stationary loss probability."""
        return self.share_bad * self.loss_bad + (1.0 - self.share_bad) * self.loss_good

    def _parts(self, generator: np.random.Generator) -> Iterator[Chunk]:
        """Yield gaps, as many visits to both states at a time as hold about a chunk of losses."""
        losses = self.loss_bad / self.to_good + self.loss_good / self.to_bad
        visits = math.ceil(min(CHUNK / losses, MOST_VISITS))
        is_bad = bool(generator.random() < self.share_bad)
        since = 0
        while True:
            stay, leave = generator.geometric([[self.to_bad, self.to_good]] * visits).T
            lengths = np.stack([leave, stay] if is_bad else [stay, leave], axis=1).ravel()
            states = np.tile([is_bad, not is_bad], visits)
            starts = np.cumsum(lengths) - lengths
            lost = np.concatenate(
                [
                    self._lost_in(generator, starts[states], lengths[states], self.loss_bad),
                    self._lost_in(generator, starts[~states], lengths[~states], self.loss_good),
                ]
            )
            lost.sort()
            yield np.diff(lost, prepend=-1 - since)
            total = int(lengths.sum())
            since = total - 1 - int(lost[-1]) if len(lost) else since + total

    @staticmethod
    def _lost_in(
        generator: np.random.Generator, starts: Chunk, lengths: Chunk, probability: float
    ) -> Chunk:
        """Return which packets of some visits are lost, by their places among all packets.

        Losses of many visits to one state are one Bernoulli sequence over their packets.
        """
        total = int(lengths.sum())
        if probability == 0 or total == 0:
            return np.empty(0, dtype=np.int64)
        if probability == 1:
            within = np.arange(total)
        else:
            count = int(generator.binomial(total, probability))
            within = np.sort(generator.choice(total, count, replace=False, shuffle=False))
        ends = np.cumsum(lengths)
        visit = np.searchsorted(ends, within, side="right")
        places: Chunk = starts[visit] + within - (ends - lengths)[visit]
        return places


class GilbertElliottEntry(Entry):
    """Losses in bursts."""

    model: Literal["gilbert_elliott"] = Field(description="which loss model this is")
    to_bad: Share = Field(
        ge=1e-6, le=1, description="probability that the good state ends with a packet"
    )
    to_good: Share = Field(
        ge=1e-6, le=1, description="probability that the bad state ends with a packet"
    )
    loss_good: Share = Field(
        0.0, ge=0, lt=1, description="probability that a packet is lost in the good state"
    )
    loss_bad: Share = Field(
        1.0, ge=1e-3, le=1, description="probability that a packet is lost in the bad state"
    )

    @model_validator(mode="after")
    def _ordered(self) -> "GilbertElliottEntry":
        if self.loss_good > self.loss_bad:
            raise ValueError(
                f"'loss_good' must not exceed 'loss_bad' ({self.loss_good:g} > {self.loss_bad:g})"
            )
        return self

    def loss(self) -> Loss:
        """Return the model."""
        return GilbertElliott(self.to_bad, self.to_good, self.loss_good, self.loss_bad)

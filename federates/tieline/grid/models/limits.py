"""The check that an operating point lies within a model's limits."""

import numpy as np

from tieline.grid.models.base import Array


class OutsideLimitError(ValueError):
    """An operating point violates a limit of one unit of a group.

    Attributes:
        position: the unit's place in its group.
    """

    def __init__(self, position: int, text: str) -> None:
        super().__init__(text)
        self.position = position


def require_within(name: str, value: Array, low: Array | float, high: Array | float) -> None:
    """Raise for the first unit whose `value` (n,) lies outside [low, high].

    Raises:
        OutsideLimitError: it does; the message gives the value and both limits.
    """
    low, high = np.broadcast_to(low, value.shape), np.broadcast_to(high, value.shape)
    for position in np.flatnonzero((value < low) | (value > high)):
        given, least, most = value[position], low[position], high[position]
        raise OutsideLimitError(
            int(position), f"{name} = {given:.4g} at the start, outside [{least:g}, {most:g}]"
        )

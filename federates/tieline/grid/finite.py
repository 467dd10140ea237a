"""No number that is none leaves the grid: the first offending one is named, with the time."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tieline.errors import NumericalError

LARGEST_IN_A_FRAME = float(np.finfo(np.float32).max)
"""Frames carry single precision, in which a greater number would be infinity."""


def check_finite(
    values: NDArray[np.generic],
    name_of: Callable[[int], str],
    at_s: float,
    largest: float = np.finfo(np.float64).max,
) -> None:
    """Refuse values of which one is NaN, infinite or beyond what the reader can hold.

    Args:
        values: (n,) real or complex.
        name_of: the name of a value by its place, such as `f_hz.B61`.
        at_s: simulated time, s.
        largest: the greatest magnitude that is allowed.

    Raises:
        NumericalError: there is one; the message names the first.
    """
    is_sound = np.abs(values) <= largest
    if is_sound.all():
        return
    first = int(np.argmin(is_sound))
    value = values[first]
    what = "is not finite" if not np.isfinite(value) else f"is beyond {largest:.3g}"
    raise NumericalError(f"{name_of(first)} {what} ({value:.6g}) at t = {at_s:.4f} s")

"""Jitter distributions: within their bounds, with the mean that they state."""

import numpy as np
import pytest

from tieline.network.jitter import GammaJitter, NormalJitter, UniformJitter
from tieline.streams import stream

MEMBERS = [
    UniformJitter(0, 1_000_000),
    UniformJitter(300, 300),
    UniformJitter(5, 9),
    NormalJitter(500_000, 100_000),
    NormalJitter(500_000, 900_000),
    GammaJitter(500_000, 500_000),
    GammaJitter(500_000, 50_000),
    GammaJitter(200_000, 800_000),
]
COUNT = 40_000


@pytest.mark.parametrize("jitter", MEMBERS, ids=repr)
def test_draws_stay_within_the_stated_ends(jitter):
    """Otherwise a packet could arrive before light could bring it."""
    drawn = jitter.draw(stream(1, repr(jitter)), COUNT)
    assert drawn.dtype == np.int64
    assert drawn.min() >= jitter.least_ns >= 0
    if isinstance(jitter, UniformJitter):
        assert drawn.max() <= jitter.high_ns
    if isinstance(jitter, NormalJitter):
        assert drawn.max() <= 2 * jitter.centre_ns


@pytest.mark.parametrize("jitter", MEMBERS, ids=repr)
def test_the_mean_is_the_stated_one(jitter):
    """Otherwise network.mean_delay would reach another mean than it promises."""
    drawn = jitter.draw(stream(2, repr(jitter)), COUNT)
    # Four standard errors of the mean, and half a nanosecond of rounding.
    assert abs(drawn.mean() - jitter.mean_ns) < 4 * drawn.std() / np.sqrt(COUNT) + 0.5


def test_uniform_and_gamma_have_their_variance():
    """Otherwise the deviation that a topology file gives would mean something else."""
    uniform = UniformJitter(0, 1_000_000).draw(stream(3, "u"), COUNT)
    gamma = GammaJitter(400_000, 200_000).draw(stream(3, "g"), COUNT)
    # The relative standard error of a standard deviation is sqrt((kurtosis - 1) / (4 n)):
    # 0.0022 (uniform, kurtosis 1.8) and 0.0047 (gamma of shape 4, kurtosis 4.5); five of them.
    assert uniform.std() == pytest.approx(1_000_000 / np.sqrt(12), rel=0.011)
    assert gamma.std() == pytest.approx(200_000, rel=0.024)

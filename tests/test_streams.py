"""Named random streams: the same for ever, and independent of one another."""

import numpy as np

from tieline.streams import stream


def test_the_same_seed_and_name_give_the_same_numbers():
    """Otherwise no run could ever be repeated."""
    assert np.array_equal(
        stream(7, "loss of A->B").random(100), stream(7, "loss of A->B").random(100)
    )


def test_the_numbers_of_a_name_are_fixed_for_ever():
    """Otherwise a stored result would change with the library and nobody would notice.

    Our own stored output, only to notice change.
    """
    drawn = stream(1, "arrivals of cross flow 3").integers(0, 1000, 5)
    assert drawn.tolist() == [266, 612, 950, 77, 577]


def test_names_and_seeds_that_look_alike_give_independent_numbers():
    """Otherwise two links would lose packets at the same instants."""
    names = ["loss of A->B", "loss of B->A", "loss of A->B ", "jitter of A->B"]
    drawn = [stream(seed, name).standard_normal(20_000) for seed in (0, 1, 2**40) for name in names]
    correlation = np.corrcoef(drawn) - np.eye(len(drawn))
    # A correlation of n independent pairs has standard deviation 1 / sqrt(n) = 0.0071; 66 pairs
    # stay below five of those with a probability of 1 - 4e-5.
    assert np.abs(correlation).max() < 5 / np.sqrt(20_000)

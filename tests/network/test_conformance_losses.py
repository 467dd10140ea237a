"""Every model of loss: its gaps, its stated share, its entry, and what it refuses."""

from itertools import islice

import numpy as np
import pytest

from network.files import link_with, refused, two_nodes
from tieline.network import losses
from tieline.network.draws import CHUNK
from tieline.network.losses import LOSSES, Bernoulli, BitError, GilbertElliott, Loss, LossTrace
from tieline.streams import stream

ENTRIES = {
    "bernoulli": [("probability: 0.02", Bernoulli(0.02)), ("probability: 0.9", Bernoulli(0.9))],
    "bit_error": [("rate: 1.0e-5", BitError(1e-5)), ("rate: 1.0e-15", BitError(1e-15))],
    "gilbert_elliott": [
        ("to_bad: 0.01, to_good: 0.2", GilbertElliott(0.01, 0.2)),
        (
            "to_bad: 0.1, to_good: 0.3, loss_good: 0.01, loss_bad: 0.5",
            GilbertElliott(0.1, 0.3, 0.01, 0.5),
        ),
        ("to_bad: 1, to_good: 1", GilbertElliott(1.0, 1.0)),
        ("to_bad: 1.0e-6, to_good: 1.0e-6", GilbertElliott(1e-6, 1e-6)),
        (
            "to_bad: 1.0e-6, to_good: 1, loss_bad: 0.001",
            GilbertElliott(1e-6, 1.0, 0.0, 0.001),
        ),
    ],
}
"""For each word of the registry: entries and the models that they must give."""

BAD = [
    ("bernoulli", "probability: 0", "links.0.loss.probability must be greater than 0 (got 0)"),
    ("bernoulli", "probability: 1", "links.0.loss.probability must be less than 1 (got 1)"),
    ("bernoulli", "", "links.0.loss lacks 'probability'"),
    ("bit_error", "rate: 0.1", "links.0.loss.rate must be less than or equal to 0.0001 (got 0.1)"),
    ("bit_error", "rate: 0", "links.0.loss.rate must be greater than or equal to 0.0"),
    ("gilbert_elliott", "to_bad: 0, to_good: 1", "links.0.loss.to_bad must be greater than"),
    ("gilbert_elliott", "to_bad: 1, to_good: 1.5", "links.0.loss.to_good must be less than"),
    (
        "gilbert_elliott",
        "to_bad: 0.1, to_good: 0.1, loss_bad: 1.0e-9",
        "links.0.loss.loss_bad must be greater than or equal to 0.001",
    ),
    (
        "gilbert_elliott",
        "to_bad: 0.1, to_good: 0.1, loss_good: 0.6, loss_bad: 0.5",
        "links.0.loss 'loss_good' must not exceed 'loss_bad' (0.6 > 0.5)",
    ),
    ("gilbert_elliott", "to_bad: 0.1, togood: 0.1", None),
]

MODELS = [
    Bernoulli(0.001),
    Bernoulli(0.3),
    Bernoulli(0.95),
    BitError(1e-5),
    BitError(1e-9),
    GilbertElliott(0.01, 0.2),
    GilbertElliott(0.3, 0.1),
    GilbertElliott(0.02, 0.1, 0.01, 0.4),
    GilbertElliott(0.4, 0.6, 0.2, 0.7),
    GilbertElliott(1.0, 1.0),
    GilbertElliott(1e-4, 0.5, 0.0, 0.05),
]
"""Models whose share is a mean; a list of losses has none."""


def drawn(loss: Loss, seed: int, chunks: int = 4) -> list[np.ndarray]:
    """Return the first chunks of a model's gaps."""
    return list(islice(loss.gaps(stream(seed, repr(loss))), chunks))


def test_every_model_is_tried_here():
    """Otherwise a new model could be added without a test: add it to `ENTRIES` and `MODELS`."""
    assert set(ENTRIES) == set(LOSSES) == {bad[0] for bad in BAD}
    made = {type(model) for entries in ENTRIES.values() for _, model in entries}
    assert made == {type(model) for model in MODELS}
    public = [getattr(losses, name) for name in losses.__all__]
    assert {kind for kind in public if hasattr(kind, "gaps")} == {*made, LossTrace, Loss}


@pytest.mark.parametrize(
    ("word", "words", "model"),
    [(word, *entry) for word, entries in ENTRIES.items() for entry in entries],
)
def test_an_entry_gives_its_model(tmp_path, word, words, model):
    """Otherwise a topology file would lose packets in another manner than it says."""
    assert link_with(tmp_path, f"loss: {{model: {word}, {words}}}").loss == model
    # The least and greatest values that a file may give must not stop the start of a run.
    (chunk,) = drawn(model, 1, 1)
    assert chunk.min() >= 1


@pytest.mark.parametrize(("word", "words", "finding"), BAD)
def test_a_bad_entry_is_refused_with_its_line(tmp_path, word, words, finding):
    """Otherwise a slip would run with other losses, or end in a traceback."""
    text = two_nodes(f"loss: {{model: {word}, {words}}}")
    if finding is None:
        text = text.replace("togood: 0.1", "to_good: 0.1, good: 1")
        finding = "unknown key 'good' (did you mean 'to_good'?)"
    assert refused(tmp_path, text).startswith(finding)


@pytest.mark.parametrize("model", [*MODELS, LossTrace((0, 1, 5, 4000))], ids=repr)
def test_gaps_come_in_chunks_of_whole_numbers_from_one_up(model):
    """Otherwise the kernel would read beyond its numbers, or lose a packet twice."""
    for chunk in drawn(model, 3):
        assert (chunk.shape, chunk.dtype) == ((CHUNK,), np.dtype(np.int64))
        assert chunk.min() >= 1


@pytest.mark.parametrize("model", MODELS, ids=repr)
def test_the_same_seed_loses_the_same_packets(model):
    """Otherwise an experiment could not be repeated, or its repetitions would all be one."""
    first, again, other = (np.concatenate(drawn(model, seed)) for seed in (7, 7, 8))
    assert np.array_equal(first, again)
    # With both probabilities 1 every second packet is lost, whatever the seed.
    if model != GilbertElliott(1.0, 1.0):
        assert not np.array_equal(first, other)


@pytest.mark.parametrize("model", MODELS, ids=repr)
def test_the_stated_share_is_met(model):
    """Otherwise a loss of 1 % in a study would be another.

    The mean gap is the reciprocal of the share of one unit (a packet, or a bit). Gaps of bursts
    depend on each other; means of 64 batches of 512 nearly do not.
    """
    unit = model.rate if model.counts == "bits" else model.share(100)
    batches = np.concatenate(drawn(model, 5, 8)).reshape(64, -1).mean(axis=1)
    error = batches.std(ddof=1) / np.sqrt(len(batches))
    assert abs(batches.mean() - 1 / unit) <= 4 * error
    assert error < 0.06 / unit


@pytest.mark.parametrize("size", [40, 576, 1500])
def test_a_link_with_bit_errors_has_the_share_that_it_states(size):
    """Otherwise reports that quote a link's loss would quote another.

    1 - (1 - rate)^bits, here by the product of all bits.
    """
    assert BitError(1e-4).share(size) == pytest.approx(1 - np.prod(np.full(8 * size, 1 - 1e-4)))


def test_bursts_have_their_mean_length():
    """Otherwise bursts of losses would be shorter than the outages that they stand for.

    With all lost in the bad state and none in the good one, a burst is a visit to the bad state:
    geometric with mean 1 / to_good and standard deviation sqrt(1 - to_good) / to_good.
    """
    model = GilbertElliott(0.02, 0.25)
    gaps = np.concatenate(drawn(model, 11, 40))
    ends = np.flatnonzero(gaps > 1)
    lengths = np.diff(ends)
    error = np.sqrt(0.75) / 0.25 / np.sqrt(len(lengths))
    assert abs(lengths.mean() - 4) < 4 * error
    # The time without losses is a visit to the good state, mean 1 / to_bad.
    quiet = gaps[ends] - 1
    assert abs(quiet.mean() - 50) < 4 * np.sqrt(0.98) / 0.02 / np.sqrt(len(quiet))
    # P(length > k) = (1 - to_good)^k.
    for k in (1, 5, 12):
        p = 0.75**k
        assert abs(np.mean(lengths > k) - p) < 4 * np.sqrt(p * (1 - p) / len(lengths))


def test_losses_of_a_mixed_state_follow_the_markov_chain():
    """Otherwise losses in a state that loses some packets would come evenly, not in bursts.

    Two neighbours are both lost with the probability pi D P D 1, D holding the loss probabilities
    and P the transitions of the states.
    """
    model = GilbertElliott(0.05, 0.2, 0.02, 0.6)
    gaps = np.concatenate(drawn(model, 12, 40))
    steps = np.array([[0.95, 0.05], [0.2, 0.8]])
    loses = np.diag([0.02, 0.6])
    stationary = np.array([0.8, 0.2])
    after_a_loss = (stationary @ loses @ steps @ loses).sum() / model.share(100)
    is_next = (gaps == 1).reshape(160, -1).mean(axis=1)
    error = is_next.std(ddof=1) / np.sqrt(len(is_next))
    assert abs(is_next.mean() - after_a_loss) < 4 * error
    assert error < 0.01


def test_a_list_of_losses_is_followed_and_then_ends():
    """Otherwise the losses of a recording, or of another simulator, could not be repeated."""
    first, second = drawn(LossTrace((0, 1, 5)), 1, 2)
    assert (np.cumsum(first[:3]) - 1).tolist() == [0, 1, 5]
    assert min(first[3:].min(), second.min()) > 10**18
    assert LossTrace((0, 1, 5)).share(100) == 0

"""Every distribution of jitter: its bounds, its stated mean, its entry, and what it refuses."""

import numpy as np
import pytest

from network.files import link_with, refused, two_nodes
from tieline.network import jitter as jitters
from tieline.network.draws import CHUNK
from tieline.network.jitter import (
    JITTERS,
    ConstantJitter,
    EmpiricalJitter,
    GammaJitter,
    Jitter,
    NormalJitter,
    UniformJitter,
)
from tieline.network.packet.draws import jitters as chunks_of
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
    ConstantJitter(0),
    ConstantJitter(30_000),
    EmpiricalJitter((5,)),
    EmpiricalJitter((10, 700, 700, 90_000)),
]
COUNT = 40_000

ENTRIES = {
    "constant": [("delay: 30 us", ConstantJitter(30_000)), ("delay: 0", ConstantJitter(0))],
    "uniform": [("low: 0, high: 1 ms", UniformJitter(0, 1_000_000))],
    "normal": [
        ("mean: 2 ms, deviation: 1 ms", NormalJitter(2_000_000, 1_000_000)),
        ("mean: 1 ns, deviation: 100 ns", NormalJitter(1, 100)),
    ],
    "gamma": [("mean: 2 ms, deviation: 1 ms", GammaJitter(2_000_000, 1_000_000))],
    "empirical": [("file: sample.csv", EmpiricalJitter((1_000_000, 0, 2_500_000)))],
}
"""For each word of the registry: entries and the distributions that they must give."""

BAD = [
    ("constant", "delay: -1 ms", "links.0.jitter.delay must be greater than or equal to 0"),
    ("constant", "delay: 11 s", "links.0.jitter.delay must be less than or equal to 10"),
    ("constant", "", "links.0.jitter lacks 'delay'"),
    ("uniform", "low: 2 s, high: 1 s", "links.0.jitter 'low' must not exceed 'high' (2 s > 1 s)"),
    ("normal", "mean: 0, deviation: 1 s", "links.0.jitter.mean must be greater than or equal"),
    (
        "normal",
        "mean: 1 ns, deviation: 10 s",
        "links.0.jitter 'deviation' must not exceed 100 times 'mean' (10 s > 100 x 1e-09 s)",
    ),
    ("gamma", "mean: 1 ms, devation: 1 ms, deviation: 1 ms", "unknown key 'devation' (did you"),
    ("empirical", "file: missing.csv", "links.0.jitter.file cannot read "),
    ("empirical", "file: [1, 2]", "links.0.jitter.file must be the path of a file (got [1, 2])"),
]

BAD_SAMPLES = [
    ("delay\n1\n", ":1: no column 'delay_s' (has ['delay'])"),
    ("delay_s\n", " holds no delay"),
    ("delay_s\n0.1\nx\n", ":3: 'delay_s' must be >= 0 and <= 10 s (got 'x')"),
    ("delay_s\n-1\n", ":2: 'delay_s' must be >= 0 and <= 10 s (got '-1')"),
]


def test_every_distribution_is_tried_here():
    """Otherwise a new one could be added without a test: add it to `ENTRIES` and `MEMBERS`."""
    assert set(ENTRIES) == set(JITTERS) == {bad[0] for bad in BAD}
    made = {type(member) for entries in ENTRIES.values() for _, member in entries}
    assert made == {type(member) for member in MEMBERS}
    public = [getattr(jitters, name) for name in jitters.__all__]
    assert {kind for kind in public if hasattr(kind, "draw")} == {*made, Jitter}


@pytest.mark.parametrize(
    ("word", "words", "expected"),
    [(word, *entry) for word, entries in ENTRIES.items() for entry in entries],
)
def test_an_entry_gives_its_distribution(tmp_path, word, words, expected):
    """Otherwise a topology file would delay packets in another manner than it says."""
    (tmp_path / "sample.csv").write_text("n,delay_s\n1,0.001\n2,0\n3,0.0025\n", encoding="utf-8")
    made = link_with(tmp_path, f"jitter: {{distribution: {word}, {words}}}").jitter
    assert made == expected
    assert made.draw(stream(1, word), CHUNK).min() >= 0


@pytest.mark.parametrize(("word", "words", "finding"), BAD)
def test_a_bad_entry_is_refused_with_its_line(tmp_path, word, words, finding):
    """Otherwise a slip would run with another jitter, or never end."""
    text = two_nodes(f"jitter: {{distribution: {word}, {words}}}")
    assert refused(tmp_path, text).startswith(finding)


@pytest.mark.parametrize(("sample", "finding"), BAD_SAMPLES)
def test_a_bad_sample_is_refused_with_both_lines(tmp_path, sample, finding):
    """Otherwise a damaged measurement would be used as another one."""
    (tmp_path / "sample.csv").write_text(sample, encoding="utf-8")
    found = refused(tmp_path, two_nodes("jitter: {distribution: empirical, file: sample.csv}"))
    assert f"sample.csv{finding}" in found


@pytest.mark.parametrize("jitter", MEMBERS, ids=repr)
def test_the_kernel_gets_chunks_and_the_same_ones_for_a_seed(jitter):
    """Otherwise the kernel would read beyond its numbers, or a run could not be repeated."""
    one, again = chunks_of(7, "j", jitter), chunks_of(7, "j", jitter)
    for _ in range(2):
        chunk = next(one)
        assert (chunk.shape, chunk.dtype) == ((CHUNK,), np.dtype(np.int64))
        assert np.array_equal(chunk, next(again))
    if jitter.draw(stream(1, "j"), 100).std() > 0:
        assert not np.array_equal(next(one), next(chunks_of(8, "j", jitter)))


def test_an_empirical_jitter_draws_each_value_as_often_as_it_was_measured():
    """Otherwise the tail of a measured delay would be lost."""
    drawn = EmpiricalJitter((10, 700, 700, 90_000)).draw(stream(4, "e"), COUNT)
    for value, p in ((10, 0.25), (700, 0.5), (90_000, 0.25)):
        assert abs(np.sum(drawn == value) - COUNT * p) < 4 * np.sqrt(COUNT * p * (1 - p))


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

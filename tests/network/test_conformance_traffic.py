"""Every kind of traffic: its gaps, its stated rate, its entry, and what it refuses."""

import math
from itertools import islice

import numpy as np
import pytest

from network.files import read, refused, two_nodes
from tieline.network import traffic
from tieline.network.draws import CHUNK
from tieline.network.packet.draws import gaps
from tieline.network.spec import CrossFlow
from tieline.network.traffic import (
    HEADER_BYTES,
    TRAFFIC,
    Cbr,
    Files,
    Greedy,
    OnOff,
    Poisson,
    Polling,
    Trace,
    Traffic,
)
from tieline.streams import stream

MS = 1_000_000
ENTRIES = {
    "cbr": [("rate: 2 Mbit/s, payload: 222", Cbr(2e6, 222))],
    "poisson": [("rate: 2 Mbit/s, payload: 222", Poisson(2e6, 222))],
    "on_off": [
        (
            "rate: 2 Mbit/s, payload: 222, mean_on: 500 ms, mean_off: 1 s",
            OnOff(2e6, 222, 500 * MS, 1000 * MS),
        ),
        (
            "rate: 2 Mbit/s, payload: 222, mean_on: 10 ms, mean_off: 1 s, shape: 1.5",
            OnOff(2e6, 222, 10 * MS, 1000 * MS, 1.5),
        ),
        # A chunk of times on holds more datagrams than any memory.
        (
            "rate: 10 Gbit/s, payload: 1, mean_on: 10000 s, mean_off: 10000 s, shape: 1.001",
            OnOff(1e10, 1, 10**13, 10**13, 1.001),
        ),
    ],
    "files": [
        (
            "rate: 8 Mbit/s, payload: 1000, size: 65000, interval: 2 s",
            Files(8e6, 1000, 65_000, 2000 * MS),
        ),
        (
            "rate: 1 Gbit/s, payload: 1, size: 10000000000, interval: 2 s",
            Files(1e9, 1, 10**10, 2000 * MS),
        ),
    ],
    "trace": [("file: record.csv", Trace(np.array([0, 1500, 2 * MS]), np.array([100, 1, 65_000])))],
    "polling": [
        ("interval: 2 s", Polling(2000 * MS, 12, 250, 5 * MS)),
        (
            "interval: 1 s, payload: 20, reply: 300, think: 1 ms",
            Polling(1000 * MS, 20, 300, 1 * MS),
        ),
    ],
    "greedy": [
        ("start: 0", Greedy(1448, 90)),
        ("payload: 500, window: 7", Greedy(500, 7)),
    ],
    "flood": [("rate: 2 Mbit/s, start: 3 s", Poisson(2e6, 18))],
}
"""For each word of the registry: entries and the traffic that they must give."""

BAD = [
    ("cbr", "rate: 0, payload: 9", "cross_traffic.0.rate must be greater than or equal to 1"),
    ("cbr", "rate: 1 Mbit/s, payload: 70000", "cross_traffic.0.payload must be less than or"),
    ("cbr", "rate: 1 Mbps, payload: 9", "cross_traffic.0.rate must be a rate in one of"),
    ("poisson", "rate: 1 Mbit/s", "cross_traffic.0 lacks 'payload'"),
    ("poisson", "rate: 1 Mbit/s, payload: 9, dscp: 64", "cross_traffic.0.dscp must be less than"),
    (
        "poisson",
        "rate: 1 Mbit/s, payload: 9, start: 2 s, stop: 1 s",
        "cross_traffic.0 'stop' must be after 'start' (1 s, 2 s)",
    ),
    ("on_off", "rate: 1 Mbit/s, payload: 9, mean_on: 1 s", "cross_traffic.0 lacks 'mean_off'"),
    (
        "on_off",
        "rate: 1 Mbit/s, payload: 9, mean_on: 1 s, mean_off: 1 s, shape: 1",
        "cross_traffic.0.shape must be greater than 1",
    ),
    (
        "on_off",
        "rate: 1 bit/s, payload: 72, mean_on: 1 ms, mean_off: 1 s",
        "cross_traffic.0 'mean_on' must be at least 1/1000 of the 800 s from datagram to datagram "
        "(got 0.001 s)",
    ),
    (
        "files",
        "rate: 1 Mbit/s, payload: 9, size: 0, interval: 1 s",
        "cross_traffic.0.size must be greater than or equal to 1",
    ),
    ("trace", "file: missing.csv", "cross_traffic.0.file cannot read "),
    ("trace", "file: 5", "cross_traffic.0.file must be the path of a file (got 5)"),
    ("trace", "fil: record.csv", None),
    ("polling", "interval: 0", "cross_traffic.0.interval must be greater than or equal to 0.001"),
    (
        "polling",
        "interval: 1 s, payload: 0",
        "cross_traffic.0.payload must be greater than or equal to 1 (got 0)",
    ),
    ("polling", "interval: 1 s, reply: 70000", "cross_traffic.0.reply must be less than or equal"),
    ("greedy", "window: 0", "cross_traffic.0.window must be greater than or equal to 1 (got 0)"),
    ("greedy", "payload: 0", "cross_traffic.0.payload must be greater than or equal to 1 (got 0)"),
    ("flood", "rate: 1 Mbit/s", "cross_traffic.0 lacks 'start'"),
]

RECORD = "time_s,payload_bytes\n0,100\n0.0000015,1\n0.002,65000\n"

BAD_RECORDS = [
    ("time_s,bytes\n0,1\n", ":1: no column 'payload_bytes' (has ['time_s', 'bytes'])"),
    ("", ":1: no column 'time_s' (has None)"),
    ("time_s,payload_bytes\n0,1\nx,1\n", ":3: 'time_s' must be >= 0 and <= 1e+09 (got 'x')"),
    ("time_s,payload_bytes\n0,0\n", ":2: 'payload_bytes' must be >= 1 and <= 65000 (got '0')"),
    ("time_s,payload_bytes\n0,1.5\n", ":2: 'payload_bytes' must be a whole number (got '1.5')"),
    ("time_s,payload_bytes\n1\n", ":2: 'payload_bytes' must be >= 1 and <= 65000 (got None)"),
    (
        "time_s,payload_bytes\n2,1\n1.5,1\n",
        ":3: 'time_s' must not be before the line above (1.5 s after 2 s)",
    ),
]

MEMBERS = [
    Cbr(3e6, 222),
    Cbr(1e11, 972),
    Poisson(3e6, 222),
    OnOff(5e6, 222, 10 * MS, 30 * MS),
    OnOff(5e6, 222, 10 * MS, 30 * MS, 2.5),
    OnOff(1e5, 222, 1 * MS, 1 * MS),
    Files(8e6, 972, 20_000, 100 * MS),
    Files(8e6, 972, 20_000, 1 * MS),
    Polling(1000 * MS, 12, 250, 5 * MS),
    Greedy(1448, 90),
    Trace(np.array([0, 1500, 2 * MS]), np.array([100, 1, 65_000])),
]
WITH_RATE = [member for member in MEMBERS if not isinstance(member, Greedy | Polling | Trace)]


def drawn(member: Traffic, seed: int, chunks: int = 4) -> list[np.ndarray]:
    """Return the first chunks of a flow's gaps, ns."""
    return list(islice(member.gaps(stream(seed, type(member).__name__)), chunks))


def same(one: Traffic, other: Traffic) -> bool:
    """Return whether two are alike; traces compare by what they hold."""
    if isinstance(one, Trace) and isinstance(other, Trace):
        return np.array_equal(one.times_ns, other.times_ns) and np.array_equal(
            one.payloads, other.payloads
        )
    return one == other


def test_every_kind_is_tried_here():
    """Otherwise a new kind could be added without a test: add it to `ENTRIES` and `MEMBERS`."""
    assert set(ENTRIES) == set(TRAFFIC) == {bad[0] for bad in BAD}
    made = {type(kind) for entries in ENTRIES.values() for _, kind in entries}
    assert made == {type(member) for member in MEMBERS}
    public = [getattr(traffic, name) for name in traffic.__all__]
    assert {kind for kind in public if hasattr(kind, "gaps")} == {*made, Traffic}


@pytest.mark.parametrize(
    ("word", "words", "expected"),
    [(word, *entry) for word, entries in ENTRIES.items() for entry in entries],
)
def test_an_entry_gives_its_traffic(tmp_path, word, words, expected):
    """Otherwise a topology file would fill its queues with other traffic than it says."""
    (tmp_path / "record.csv").write_text(RECORD, encoding="utf-8")
    spec = read(tmp_path, two_nodes(flow=f"kind: {word}, dscp: 10, {words}"))
    (flow,) = spec.cross_flows
    assert same(flow.traffic, expected)
    assert (flow.route, flow.way_back, flow.dscp) == (("a", "b"), ("b", "a"), 10)
    assert flow.start_ns == (3_000 * MS if word == "flood" else 0)
    # The greatest values that a file may give must not stop the start of a run.
    assert drawn(flow.traffic, 1, 1)[0].min() >= 0


@pytest.mark.parametrize(("word", "words", "finding"), BAD)
def test_a_bad_entry_is_refused_with_its_line(tmp_path, word, words, finding):
    """Otherwise a slip would run with other traffic, or end in a traceback."""
    text = two_nodes(flow=f"kind: {word}, {words}")
    if finding is None:
        (tmp_path / "record.csv").write_text(RECORD, encoding="utf-8")
        text = text.replace("fil: ", "fil: 1, file: ")
        finding = "unknown key 'fil' (did you mean 'file'?)"
    assert refused(tmp_path, text).startswith(finding)


@pytest.mark.parametrize(("record", "finding"), BAD_RECORDS)
def test_a_bad_record_is_refused_with_both_lines(tmp_path, record, finding):
    """Otherwise a damaged recording would be replayed as another one."""
    (tmp_path / "record.csv").write_text(record, encoding="utf-8")
    found = refused(tmp_path, two_nodes(flow="kind: trace, file: record.csv"))
    assert found.startswith("cross_traffic.0.file ")
    assert f"record.csv{finding}" in found


@pytest.mark.parametrize("member", MEMBERS, ids=lambda member: repr(member)[:60])
def test_gaps_come_in_chunks_of_whole_numbers_from_zero_up(member):
    """Otherwise the kernel would read beyond its numbers, or time would go back."""
    for chunk in drawn(member, 3):
        assert (chunk.shape, chunk.dtype) == ((CHUNK,), np.dtype(np.int64))
        assert chunk.min() >= 0


@pytest.mark.parametrize("member", MEMBERS, ids=lambda member: repr(member)[:60])
def test_the_same_seed_sends_at_the_same_times(member):
    """Otherwise an experiment could not be repeated, or its repetitions would all be one."""
    first, again, other = (np.concatenate(drawn(member, seed)) for seed in (7, 7, 8))
    assert np.array_equal(first, again)
    is_fixed = isinstance(member, Greedy | Trace)
    assert np.array_equal(first, other) == is_fixed


@pytest.mark.parametrize("member", WITH_RATE, ids=repr)
def test_the_stated_rate_is_met(member):
    """Otherwise a topology's cross traffic would be more or less than it says.

    Bursts make neighbouring gaps depend on each other; means of chunks nearly do not. The first
    chunk, which holds the phase or the first time off, is left out.
    """
    batches = np.array([chunk.mean() for chunk in drawn(member, 5, 81)[1:]])
    gap_ns = (member.payload_bytes + HEADER_BYTES) * 8e9 / member.rate_bps
    error = batches.std(ddof=1) / np.sqrt(len(batches))
    # Half a nanosecond of rounding at either end of all the chunks.
    assert abs(batches.mean() - gap_ns) < 4 * error + 1 / (80 * CHUNK)
    assert error < 0.03 * gap_ns


@pytest.mark.parametrize("member", MEMBERS, ids=lambda member: repr(member)[:60])
def test_a_factor_scales_the_rate_where_there_is_one(member):
    """Otherwise a sweep over load would sweep something else."""
    scaled = member.scaled(0.5)
    if member in WITH_RATE:
        least = member.pace_bps if member.rate_bps == getattr(member, "pace_bps", 0) else 0
        assert scaled.rate_bps == pytest.approx(max(member.rate_bps / 2, least))
    else:
        assert scaled is member


def test_kinds_without_a_rate_say_so():
    """Otherwise a load would be computed from a rate that nobody set."""
    assert all(math.isnan(member.rate_bps) for member in (MEMBERS[8], MEMBERS[9]))
    # 128 + 29 bytes in 2 ms; the last datagram ends the time that counts.
    assert MEMBERS[10].rate_bps == pytest.approx((128 + 29) * 8 / 0.002)
    assert MEMBERS[10].payload_bytes == 65_000
    assert math.isnan(Trace(np.array([5]), np.array([9])).rate_bps)


def test_stations_are_polled_at_equal_gaps():
    """Otherwise SCADA cycles would drift."""
    chunk = drawn(Polling(1000 * MS, 12, 250, 5 * MS), 1, 2)
    assert 0 <= chunk[0][0] < 1000 * MS
    assert set(np.concatenate(chunk)[1:].tolist()) == {1000 * MS}


def test_pareto_times_have_their_tail():
    """Otherwise self-similar traffic would be ordinary traffic.

    Datagrams 1 us apart, times on of 1 ms in the mean and of shape 1.5, so at least 333 us long:
    the share of times that are longer than x is (333 us / x)^1.5; so it is of the times off.
    """
    gap_ns, least_ns, shape = 1000, MS / 3, 1.5
    peak = (72 + HEADER_BYTES) * 8e9 / gap_ns
    chunks = drawn(OnOff(peak, 72, MS, MS, shape), 3, 1200)
    between = np.concatenate(chunks)
    ends = np.flatnonzero(between > 2 * gap_ns)
    on_ns, off_ns = np.diff(ends) * gap_ns, between[ends] - gap_ns
    assert len(ends) > 3000
    for factor in (1.5, 3, 10, 50):
        p = factor**-shape
        # A time on is counted to one gap, which shifts p by 1.5 * 1/500 at most.
        tolerance = 4 * np.sqrt(p * (1 - p) / len(ends)) + 0.003 * p
        assert abs(np.mean(on_ns > factor * least_ns) - p) < tolerance
        assert abs(np.mean(off_ns > factor * least_ns) - p) < tolerance


def test_files_leave_one_after_the_other_at_their_pace():
    """Otherwise two files would share a line that carries one, at twice its rate.

    Files of 21 datagrams of 1,000 bytes at 8 Mbit/s take 21 ms, and are asked for every 30 ms:
    within a file gaps are 1 ms, between files they are 1 ms or more.
    """
    between = np.concatenate(drawn(Files(8e6, 972, 20 * 972 + 1, 30 * MS), 4, 3))
    files = between[: len(between) // 21 * 21].reshape(-1, 21)
    assert set(files[:, 1:].ravel().tolist()) == {MS}
    assert files[1:, 0].min() >= MS
    # By Poisson's law a share 1 - 21 / 30 finds the line free (M/D/1 at a load of 0.7).
    assert np.mean(files[1:, 0] > MS) == pytest.approx(0.3, abs=4 * np.sqrt(0.3 * 0.7 / 500) + 0.05)


def test_flows_begin_and_end_when_they_say():
    """Otherwise an attack that is planned for one minute would last for ever."""
    flow = CrossFlow("flood", Poisson(8e6, 972), ("a", "b"), start_ns=50 * MS, stop_ns=90 * MS)
    instants = np.cumsum(next(gaps(1, flow)).astype(float))
    sent = instants[instants < 1e15]
    assert sent[0] >= 50 * MS
    assert sent[-1] < 90 * MS
    assert abs(len(sent) - 40) < 4 * np.sqrt(40)

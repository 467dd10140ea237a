"""Every queue discipline: its entry, its facts, and what it refuses."""

import pytest

from network.files import link_with, refused, two_nodes
from tieline.network import queues
from tieline.network.queues import (
    QUEUES,
    DeficitRoundRobin,
    DropTail,
    EarlyDetection,
    Queue,
    RandomEarlyDetection,
    StrictPriority,
    WaitingLine,
)
from tieline.network.queues.base import NO_LIMIT

EF, AF41 = 46, 34
ENTRIES = {
    "drop_tail": [
        ("packets: 50", DropTail(50)),
        ("packets: 50, bytes: 3000", DropTail(50, 3000)),
        # No packet is smaller than 29 bytes, so that 104 hold 3,000 of them.
        ("bytes: 3000", DropTail(104, 3000)),
    ],
    "priority": [
        (
            "classes: [{dscp: [46, 34], packets: 20, bytes: 9000}, {packets: 60}]",
            StrictPriority(
                (WaitingLine(20, 9000), WaitingLine(60)), (frozenset({EF, AF41}), frozenset())
            ),
        ),
        ("classes: [{packets: 60}]", StrictPriority((WaitingLine(60),), (frozenset(),))),
    ],
    "deficit_round_robin": [
        (
            "classes: [{dscp: [46], packets: 20, quantum: 3000}, {packets: 60, quantum: 500}]",
            DeficitRoundRobin(
                (WaitingLine(20, NO_LIMIT, 3000), WaitingLine(60, NO_LIMIT, 500)),
                (frozenset({EF}), frozenset()),
            ),
        ),
    ],
    "red": [
        (
            "packets: 100, low: 20, high: 60",
            RandomEarlyDetection(100, EarlyDetection(20.0, 60.0, 0.1, 9)),
        ),
        (
            "packets: 9, low: 2.5, high: 9, probability: 1, weight_shift: 1",
            RandomEarlyDetection(9, EarlyDetection(2.5, 9.0, 1.0, 1)),
        ),
    ],
}
"""For each word of the registry: entries and the disciplines that they must give."""

BAD = [
    ("drop_tail", "", "links.0.queue needs a limit: 'packets' or 'bytes'"),
    ("drop_tail", "packets: 0", "links.0.queue.packets must be greater than or equal to 1 (got 0)"),
    ("drop_tail", "packets: 1000000", "links.0.queue.packets must be less than or equal to 100000"),
    ("drop_tail", "bytes: 1.5", "links.0.queue.bytes must be a valid integer (got 1.5)"),
    ("drop_tail", "packets: 5, byte: 7", "unknown key 'byte' (did you mean 'bytes'?)"),
    ("priority", "classes: []", "links.0.queue.classes"),
    (
        "priority",
        "classes: [{packets: 5}, {packets: 5}]",
        "links.0.queue every class but the last needs a 'dscp'",
    ),
    (
        "priority",
        "classes: [{packets: 5, dscp: [64]}]",
        "links.0.queue.classes.0 'dscp' must be >= 0 and <= 63 (got [64])",
    ),
    (
        "priority",
        "classes: [{packets: 5, dscp: [1, 2]}, {packets: 5, dscp: [2]}]",
        "links.0.queue dscp 2 is in two classes",
    ),
    (
        "priority",
        f"classes: [{{packets: 5, bytes: {10**15}}}]",
        "links.0.queue.classes.0.bytes must be less than or equal to 1073741824",
    ),
    (
        "deficit_round_robin",
        "classes: [{packets: 5, dscp: [1]}, {packets: 5, quantum: 100}]",
        "links.0.queue.classes.0 lacks 'quantum'",
    ),
    ("deficit_round_robin", "classes: [{packets: 5, quantum: 100}]", "links.0.queue.classes"),
    (
        "red",
        "packets: 50, low: 60, high: 20",
        "links.0.queue needs low < high <= packets (got low=60, high=20, packets=50)",
    ),
    ("red", "packets: 50, low: 5, high: 60", "links.0.queue needs low < high <= packets"),
    ("red", "packets: 50, low: 5, high: 6, probability: 0", "links.0.queue.probability must be"),
]


def test_every_discipline_is_tried_here():
    """Otherwise a new discipline could be added without a test: add it to `ENTRIES`."""
    assert set(ENTRIES) == set(QUEUES) == {bad[0] for bad in BAD}
    made = {type(queue) for entries in ENTRIES.values() for _, queue in entries}
    public = [getattr(queues, name) for name in queues.__all__]
    assert {kind for kind in public if hasattr(kind, "line_of")} == {*made, Queue}


@pytest.mark.parametrize(
    ("word", "words", "queue"),
    [(word, *entry) for word, entries in ENTRIES.items() for entry in entries],
)
def test_an_entry_gives_its_discipline(tmp_path, word, words, queue):
    """Otherwise packets would wait and be dropped in another manner than the file says."""
    made = link_with(tmp_path, f"queue: {{discipline: {word}, {words}}}").queue
    assert made == queue
    assert made.order in ("first_come", "priority", "round_robin")
    assert len(made.lines) == 1 or made.early_detection is None
    # Every mark has a line to wait in, the last line those that no other takes.
    assert {made.line_of(dscp) for dscp in range(64)} == set(range(len(made.lines)))


@pytest.mark.parametrize(("word", "words", "finding"), BAD)
def test_a_bad_entry_is_refused_with_its_line(tmp_path, word, words, finding):
    """Otherwise a slip would run with another queue, or end in a traceback."""
    text = two_nodes(f"queue: {{discipline: {word}, {words}}}")
    assert refused(tmp_path, text).startswith(finding)


def test_marks_choose_the_line():
    """Otherwise urgent packets would wait among the others."""
    marks = (frozenset({EF}), frozenset({AF41, 36}), frozenset())
    queue = StrictPriority((WaitingLine(1),) * 3, marks)
    assert [queue.line_of(dscp) for dscp in (EF, AF41, 36, 0, 63)] == [0, 1, 1, 2, 2]


def test_half_duplex_with_early_detection_is_refused(tmp_path):
    """Otherwise a link would quietly leave out one of the two."""
    words = "duplex: half, queue: {discipline: red, packets: 9, low: 2, high: 5}"
    assert refused(tmp_path, two_nodes(words)).startswith("link a-b cannot be half duplex and have")

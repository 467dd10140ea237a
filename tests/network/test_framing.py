"""What link layers add to packets and take of a line's rate, from file to link."""

import numpy as np
import pytest

from network.builders import ALL
from network.files import link_with, read, refused, two_nodes
from tieline.network.framing import FRAMINGS
from tieline.network.packet import PacketEngine

EXPECTED = {
    # 8 preamble, 14 header, 4 check, 12 gap.
    "ethernet": (100_000_000, 38, 100_000_000),
    "ppp": (10_000_000, 2, 10_000_000),
    # Flags 1, address 1, control 1, protocol 2, check 4.
    "ppp_hdlc": (2_000_000, 9, 2_000_000),
    # 24 channels of 64 kbit/s.
    "t1": (1_544_000, 9, 24 * 64_000),
    # STS-3c: 260 of 270 columns of 9 bytes, 8,000 times a second.
    "sonet": (155_520_000, 9, 260 * 9 * 8 * 8_000),
}
"""For each framing: a line's rate, the bytes added to a packet, the rate that carries them."""


def test_every_framing_is_tried_here():
    """Otherwise a new framing could be added without a test."""
    assert set(EXPECTED) == set(FRAMINGS)


@pytest.mark.parametrize("framing", EXPECTED)
def test_a_framing_adds_its_bytes_and_takes_its_share(tmp_path, framing):
    """Otherwise serialisation on real lines would be too short, and their load too low."""
    line_bps, overhead, rate_bps = EXPECTED[framing]
    link = link_with(tmp_path, f"rate: {line_bps} bit/s, framing: {framing}")
    assert (link.overhead_bytes, link.rate_bps) == (overhead, rate_bps)


@pytest.mark.parametrize("framing", EXPECTED)
@pytest.mark.parametrize("labels", [1, 3])
def test_each_mpls_label_adds_four_bytes(tmp_path, framing, labels):
    """Otherwise a label-switched path would look shorter than it is (RFC 3032)."""
    link = link_with(tmp_path, f"framing: {framing}, mpls_labels: {labels}")
    assert link.overhead_bytes == EXPECTED[framing][1] + 4 * labels
    assert link_with(tmp_path, f"overhead: 7, mpls_labels: {labels}").overhead_bytes == (
        7 + 4 * labels
    )


@pytest.mark.parametrize("framing", EXPECTED)
def test_a_frame_takes_its_bytes_on_the_link(tmp_path, framing):
    """Otherwise the bytes of a framing would be read, but not sent.

    A frame of 34 bytes with UDP and IPv4 headers and two labels: 70 bytes and the framing.
    """
    line_bps, overhead, rate_bps = EXPECTED[framing]
    words = f"rate: {line_bps} bit/s, framing: {framing}, mpls_labels: 2"
    engine = PacketEngine(read(tmp_path, two_nodes(words)), seed=1)
    engine.send(0, np.array([0]), 0)
    (arrival,) = engine.run_until(ALL).arrivals
    bits = 8 * (70 + overhead)
    assert abs(arrival["arrival_ns"] - 1_000_000 - bits * 1e9 / rate_bps) <= 0.5
    assert engine.links()[0].bytes == 70 + overhead


def test_an_own_overhead_replaces_the_framing_of_the_defaults(tmp_path):
    """Otherwise a link could not differ from the rest, or would have both overheads."""
    text = two_nodes("overhead: 5").replace("queue: 50", "queue: 50, framing: t1, mpls_labels: 1")
    link = read(tmp_path, text).links[0]
    assert (link.overhead_bytes, link.rate_bps) == (9, 10_000_000)
    text = two_nodes("framing: ppp").replace("queue: 50", "queue: 50, overhead: 100")
    assert read(tmp_path, text).links[0].overhead_bytes == 2


def test_overhead_and_framing_at_once_are_refused(tmp_path):
    """Otherwise it would be a guess which of the two counts."""
    found = refused(tmp_path, two_nodes("overhead: 5, framing: ppp"))
    assert found.startswith("links.0 'overhead' and 'framing' say the same thing")
    found = refused(tmp_path, two_nodes("framing: pp"))
    assert found.startswith(
        "links.0.framing must be 'ethernet', 'ppp', 'ppp_hdlc', 't1' or 'sonet'"
    )

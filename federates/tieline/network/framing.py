"""What link layers add to a packet, and what they take of a line's rate."""

from typing import NamedTuple


class Framing(NamedTuple):
    """Bytes added to each IP packet, and the share of the line's rate that carries them."""

    overhead_bytes: int
    share: float = 1.0


MPLS_LABEL_BYTES = 4
"""One entry of a label stack (RFC 3032)."""

FRAMINGS = {
    # Preamble and start delimiter 8, header 14, frame check 4, gap 12 (IEEE 802.3, clause 3, 4.4).
    "ethernet": Framing(38),
    # The protocol field alone, as ns-3's point-to-point links have it.
    "ppp": Framing(2),
    # Flag, address, control, protocol 2, frame check 4 (RFC 1662).
    "ppp_hdlc": Framing(9),
    # PPP in HDLC-like framing; 1 of 193 bits frames the line (ITU-T G.704, 2.1).
    "t1": Framing(9, 192 / 193),
    # PPP over SONET (RFC 2615); 10 of 270 columns of an STS-3c are overhead (ANSI T1.105).
    "sonet": Framing(9, 260 / 270),
}

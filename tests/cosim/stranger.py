"""A guest that sends what it should not to every endpoint: `stranger.py FEDERATE.json`."""

import json
import random
import sys
from collections.abc import Iterator
from pathlib import Path

import helics
import numpy as np

from tieline.cosim.guests import MODULATION, PACKETS
from tieline.cosim.interfaces import DELIVERY, ENDPOINTS, DeliveryBundle, FrameBundle
from tieline.cosim.wire import Kind, split

ANYWHERE = "stranger/any"
TARGETS = (*ENDPOINTS.values(), MODULATION, PACKETS)
ROUNDS = 4
OWN_WORDS = (b"", b"\xff\xfe", b"0.1 pu", b"9" * 1_000_000, b"none", b"\0" * 16)
"""What it says as the guest that it is, where a number is expected."""


def payloads(k: int) -> Iterator[bytes]:
    """Yield what no endpoint waits for: noise, nothing, a megabyte, and bundles gone wrong."""
    draw = random.Random(k)
    yield draw.randbytes(100)
    yield b""
    yield draw.randbytes(1_000_000)
    frames = FrameBundle(k * 1000, np.zeros((3, 34), np.uint8)).to_bytes()
    arrivals = np.zeros(5, DELIVERY)
    deliveries = DeliveryBundle(k * 1000, arrivals, np.zeros((1, 34), np.uint8)).to_bytes()
    for bundle in (frames, deliveries):
        (whole,) = split(Kind.BUNDLE, k, bundle, None)
        yield whole
        yield whole[: len(whole) // 2]
        yield b"XXXX" + whole[4:]
    yield from split(Kind.END, k, bytes(48), None)


def main() -> None:
    """Take part, send, and leave at the end."""
    config = json.loads(Path(sys.argv[1]).read_text())
    clock = config["tieline"]
    federate = helics.helicsCreateMessageFederateFromConfig(sys.argv[1])
    own = helics.helicsFederateGetEndpoint(federate, config["endpoints"][0]["name"])
    anywhere = helics.helicsFederateRegisterGlobalEndpoint(federate, ANYWHERE)
    helics.helicsFederateEnterExecutingMode(federate)
    for k in range(clock["intervals"]):
        granted_s = helics.helicsFederateRequestTime(federate, k / clock["rate_hz"] + 3e-6)
        if k >= ROUNDS:
            continue
        for target in TARGETS:
            for data in payloads(k):
                helics.helicsEndpointSendBytesTo(anywhere, data, target)
            helics.helicsEndpointSendBytesToAt(anywhere, b"from the future", target, 1e6)
            helics.helicsEndpointSendBytesToAt(anywhere, b"from the past", target, 0.0)
            forged = helics.helicsEndpointCreateMessage(anywhere)
            helics.helicsMessageSetSource(forged, ENDPOINTS["grid"])
            helics.helicsMessageSetOriginalSource(forged, ENDPOINTS["network"])
            helics.helicsMessageSetDestination(forged, target)
            helics.helicsMessageSetData(forged, b"forged")
            helics.helicsMessageSetTime(forged, granted_s)
            helics.helicsEndpointSendMessage(anywhere, forged)
        for word in OWN_WORDS:
            helics.helicsEndpointSendBytesTo(own, word, MODULATION)
    helics.helicsFederateDisconnect(federate)


if __name__ == "__main__":
    main()

"""A wide-area controller as a HELICS federate of its own: PMU packets in, a stabiliser signal out.

It damps the swing of one area against another: v_s = K (f_near - f_far) / 60 Hz, from the newest
frame of each. Started by tieline, with the path of its HELICS file as argument.
"""

import json
import struct
import sys
from pathlib import Path

import helics

NEAR, FAR = 119, 49  # buses: Alberta, southern California
GAIN = 9.0

config = json.loads(Path(sys.argv[1]).read_text())
told = config["tieline"]
federate = helics.helicsCreateMessageFederateFromConfig(sys.argv[1])
endpoint = helics.helicsFederateGetEndpoint(federate, config["endpoints"][0]["name"])
newest = {}  # bus: (instant of the measurement, frequency in Hz)


def read(frame):
    """Take one IEEE C37.118 data frame in: 34 bytes, one phasor, FREQ and DFREQ as floats."""
    _, _, idcode, second, fraction, _, _, _, f_hz, _, _ = struct.unpack(">HHHIIHffffH", frame)
    instant = second + (fraction & 0xFFFFFF) / 1e6
    bus = told["pmus"][str(idcode)]
    newest[bus] = max(newest.get(bus, (0, 60.0)), (instant, f_hz))


helics.helicsFederateEnterExecutingMode(federate)
for k in range(told["intervals"]):
    # 3 us after t_k: all that arrived up to t_k is here, and the grid hears the answer at t_k+1.
    helics.helicsFederateRequestTime(federate, (k * 10**9 // told["rate_hz"] + 3_000) / 1e9)
    while helics.helicsEndpointHasMessage(endpoint):
        message = helics.helicsEndpointGetMessage(endpoint)
        read(helics.helicsMessageGetBytes(message))
    if NEAR in newest and FAR in newest:
        v_s_pu = GAIN * (newest[NEAR][1] - newest[FAR][1]) / 60.0
        helics.helicsEndpointSendBytes(endpoint, repr(v_s_pu).encode())
helics.helicsFederateDisconnect(federate)

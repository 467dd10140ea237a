"""A plain HELICS federate as tutorials write one: it sends a measurement every 1/60 s."""

import json
import sys
import time
from pathlib import Path

import helics

port, stop_s = sys.argv[1], float(sys.argv[2])
info = helics.helicsCreateFederateInfo()
helics.helicsFederateInfoSetCoreTypeFromString(info, "zmq")
helics.helicsFederateInfoSetCoreInitString(info, f"--federates=1 --brokerport={port}")
helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_DELTA, 1 / 60)
federate = helics.helicsCreateMessageFederate("sender", info)
endpoint = helics.helicsFederateRegisterGlobalEndpoint(federate, "measurements")
helics.helicsEndpointSetDefaultDestination(endpoint, "inbox")
helics.helicsFederateEnterExecutingMode(federate)
granted_s = 0.0
with Path("sender.csv").open("w", buffering=1, encoding="utf-8") as table:
    while granted_s < stop_s:
        granted_s = helics.helicsFederateRequestTime(federate, granted_s + 1 / 60)
        helics.helicsEndpointSendBytes(endpoint, json.dumps({"t": granted_s}).encode())
        table.write(f"{granted_s}\n")
        time.sleep(0.002)
helics.helicsFederateDisconnect(federate)

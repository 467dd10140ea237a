"""A plain HELICS federate as tutorials write one: it keeps what it hears every 1/60 s."""

import json
import sys
from pathlib import Path

import helics

port, stop_s = sys.argv[1], float(sys.argv[2])
info = helics.helicsCreateFederateInfo()
helics.helicsFederateInfoSetCoreTypeFromString(info, "zmq")
helics.helicsFederateInfoSetCoreInitString(info, f"--federates=1 --brokerport={port}")
helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_DELTA, 1 / 60)
federate = helics.helicsCreateMessageFederate("receiver", info)
endpoint = helics.helicsFederateRegisterGlobalEndpoint(federate, "inbox")
helics.helicsFederateEnterExecutingMode(federate)
granted_s, newest = 0.0, None
with Path("receiver.csv").open("w", buffering=1, encoding="utf-8") as table:
    while granted_s < stop_s:
        granted_s = helics.helicsFederateRequestTime(federate, granted_s + 1 / 60)
        while helics.helicsEndpointHasMessage(endpoint):
            message = helics.helicsEndpointGetMessage(endpoint)
            newest = json.loads(helics.helicsMessageGetBytes(message))["t"]
        table.write(f"{granted_s},{newest}\n")
helics.helicsFederateDisconnect(federate)

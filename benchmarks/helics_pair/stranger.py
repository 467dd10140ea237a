"""A foreign federate that sends what nobody can read: PORT and endpoint, or its HELICS file."""

import sys

import helics

if sys.argv[1].isdigit():
    info = helics.helicsCreateFederateInfo()
    helics.helicsFederateInfoSetCoreTypeFromString(info, "zmq")
    helics.helicsFederateInfoSetCoreInitString(info, f"--federates=1 --brokerport={sys.argv[1]}")
    federate = helics.helicsCreateMessageFederate("stranger", info)
    endpoint = helics.helicsFederateRegisterGlobalEndpoint(federate, "noise")
else:
    federate = helics.helicsCreateMessageFederateFromConfig(sys.argv[1])
    endpoint = helics.helicsFederateGetEndpointByIndex(federate, 0)
helics.helicsFederateEnterExecutingMode(federate)
for k in range(1, 21):
    helics.helicsFederateRequestTime(federate, k / 20 + 3e-6)
    helics.helicsEndpointSendBytesTo(endpoint, b"\xff\x00 no measurement", sys.argv[2])
helics.helicsFederateDisconnect(federate)

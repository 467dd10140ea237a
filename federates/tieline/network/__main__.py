"""`python -m tieline.network RUN.json`: the network federate as a process."""

# Before HELICS: its ZeroMQ brings a C++ runtime of its own, and where that is loaded before the
# system's, as which the tables and ns-3 need it, ns-3's compiler can no longer print a number.
from tieline.network.federate import open_participant

# isort: split
from tieline.cosim.federate import main
from tieline.cosim.interfaces import NETWORK

if __name__ == "__main__":
    main(NETWORK, open_participant)

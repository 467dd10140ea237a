"""`python -m tieline.network RUN.json`: the network federate as a process."""

from tieline.cosim.federate import main
from tieline.cosim.interfaces import NETWORK
from tieline.network.federate import open_participant

if __name__ == "__main__":
    main(NETWORK, open_participant)

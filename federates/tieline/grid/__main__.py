"""`python -m tieline.grid RUN.json`: the grid federate."""

from tieline.cosim.federate import main
from tieline.grid.federate import open_participant

main("grid", open_participant)

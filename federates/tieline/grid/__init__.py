"""The grid: cases, power flow, device models, integration and the grid federate."""

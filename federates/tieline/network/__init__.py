"""The packet network: topology, engines and the federate that carries the frames."""

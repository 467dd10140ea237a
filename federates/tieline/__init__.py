"""A power grid and the packet network that carries its phasor measurements, simulated together."""

__version__ = "0.1.0"

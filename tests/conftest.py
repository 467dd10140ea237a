"""Settings of all tests: compiled kernels may compile inside a hypothesis example."""

from hypothesis import settings

settings.register_profile("tieline", deadline=None)
settings.load_profile("tieline")

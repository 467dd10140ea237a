"""No deadline for an example: the first one of a test may compile what it calls."""

from hypothesis import settings

settings.register_profile("compiled", deadline=None)
settings.load_profile("compiled")

"""Wide-area measurement: phasor measurement units, and what controllers make of their frames."""

from tieline.wams.coi import Fate, Readings, WideAreaAverage, checked_weights
from tieline.wams.pmu import PmuReporter
from tieline.wams.settings import WamsSettings

__all__ = ["Fate", "PmuReporter", "Readings", "WamsSettings", "WideAreaAverage", "checked_weights"]

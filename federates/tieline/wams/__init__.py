"""Wide-area measurement: phasor measurement units, and what controllers make of their frames.

Each name is imported when it is first used: whoever checks a setting needs no compiled code.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tieline.wams.coi import Fate, Readings, WideAreaAverage, checked_weights
    from tieline.wams.pmu import PmuReporter
    from tieline.wams.settings import WamsSettings

__all__ = ["Fate", "PmuReporter", "Readings", "WamsSettings", "WideAreaAverage", "checked_weights"]

_MODULES = {"PmuReporter": "pmu", "WamsSettings": "settings"}
"""Where a name stands; the others are in `coi`."""

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name not in __all__:
            raise AttributeError(f"module 'tieline.wams' has no attribute '{name}'")
        return getattr(importlib.import_module(f"tieline.wams.{_MODULES.get(name, 'coi')}"), name)

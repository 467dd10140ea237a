"""A power grid and the packet network that carries its phasor measurements, simulated together.

The names below are all that a notebook needs; each is imported when it is first used, so that
`import tieline` costs nothing.

    tieline.run("g26_trip_smoke").grid.filter(like="speed_pu")
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from tieline.api import (
        Case,
        Experiment,
        Result,
        case,
        cases,
        experiments,
        freqresp,
        load,
        modes,
        run,
    )
    from tieline.api import open as open
    from tieline.errors import CosimError, InputError, NumericalError, TielineError

# `open` is left out: a star import must not hide Python's own.
__all__ = [
    "Case",
    "CosimError",
    "Experiment",
    "InputError",
    "NumericalError",
    "Result",
    "TielineError",
    "case",
    "cases",
    "experiments",
    "freqresp",
    "load",
    "modes",
    "run",
]

_LAZY = dict.fromkeys((*__all__, "open"), "tieline.api") | {
    name: "tieline.errors" for name in __all__ if name.endswith("Error")
}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name not in _LAZY:
            raise AttributeError(f"module 'tieline' has no attribute '{name}'")
        value = getattr(importlib.import_module(_LAZY[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({"__version__", *_LAZY})

"""Linear analysis: the system at its operating point, its modes, responses and margins."""

from tieline.linear.linearise import LinearSystem, linearise
from tieline.linear.modes import Modes, modes_of
from tieline.linear.response import Response, margins, open_loop, response, zeros
from tieline.linear.study import Study, freqresp, linear, modes
from tieline.linear.sweep import Sweep, sweep

__all__ = [
    "LinearSystem",
    "Modes",
    "Response",
    "Study",
    "Sweep",
    "freqresp",
    "linear",
    "linearise",
    "margins",
    "modes",
    "modes_of",
    "open_loop",
    "response",
    "sweep",
    "zeros",
]

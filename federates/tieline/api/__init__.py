"""What a notebook does with tieline: the same as the command line, in a handful of names."""

from tieline.api.interconnection import Case, case, cases
from tieline.api.linear import freqresp, modes
from tieline.api.results import Result, open_result
from tieline.api.running import Experiment, experiments, load, run

open = open_result

__all__ = [
    "Case",
    "Experiment",
    "Result",
    "case",
    "cases",
    "experiments",
    "freqresp",
    "load",
    "modes",
    "open",
    "run",
]

"""Modes and open loops of a case, from a name, a folder or a `Case`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tieline.api.interconnection import Case
from tieline.linear import study
from tieline.linear.modes import Modes
from tieline.linear.response import Response


def modes(case: str | Path | Case, **settings: Any) -> Modes:
    """Return the modes of a case at its operating point; `.table()` shows them.

    Args:
        case: name of a shipped case, a folder, or a `Case`.
        settings: fields of `tieline.linear.Study`, such as `pss="standard"`, `gain=25`,
            `beta1=0.5`, `average="rotor"`.

    Raises:
        InputError: there is no such case, or a setting that it does not allow.
        NumericalError: the power flow diverges, or a limit is violated at the start.
    """
    return study.modes(_data(case), **settings)


def freqresp(
    case: str | Path | Case, unit: str, delay_s: float | Sequence[float] = 0.0, **settings: Any
) -> Response:
    """Return one unit's open loop, from V_ref to its stabiliser's output; `.over(f_hz)` samples it.

    Args:
        case: name of a shipped case, a folder, or a `Case`.
        unit: the unit, such as `G2`: the only one with a stabiliser, of gain 1.
        delay_s: delay of the average, s, one for all sensors or one each.
        settings: fields of `tieline.linear.Study`, such as `beta1=1`, `beta2=0.5`.

    Raises:
        InputError: there is no such case or unit, or a setting that the case does not allow.
        NumericalError: the power flow diverges, or a limit is violated at the start.
    """
    return study.freqresp(_data(case), unit, delay_s, **settings)


def _data(case: str | Path | Case) -> Any:
    return case.data if isinstance(case, Case) else case

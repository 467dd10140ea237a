"""Conditions that start an event: a recorded quantity below or above a value for some time."""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tieline.grid.case import Case
from tieline.grid.tables import near
from tieline.units import quantity

_TEXT = re.compile(r"\s*([A-Za-z_]+(?:\.\w+)?)\s*([<>])\s*(\S+?)(?:\s+for\s+(.+))?\s*")
_COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, ">": operator.gt}

UNIT_QUANTITIES = {"speed_pu": "omega", "vt_pu": "vt", "wbar_pu": "wbar"}
BUS_QUANTITIES = ("v_pu", "f_hz")


@dataclass(frozen=True)
class Condition:
    """`quantity.element` `<` or `>` `value`, held for `hold_ticks` steps.

    Attributes:
        quantity: `coi_pu`, a unit's (`speed_pu`, `vt_pu`, `wbar_pu`) or a bus's (`v_pu`, `f_hz`).
        row: row of the unit, the bus or, for `f_hz`, the sensor; 0 for `coi_pu`.
    """

    quantity: str
    row: int
    sign: str
    value: float
    hold_ticks: int

    def holds(self, value: float) -> bool:
        """Return whether a value of the quantity meets the condition."""
        return _COMPARE[self.sign](value, self.value)


def parse_condition(
    text: str, case: Case, sensors: tuple[int, ...], steps_per_second: int
) -> Condition:
    """Return the condition that a text such as `f_hz.B61 < 59.7 for 0.1 s` states.

    Raises:
        ValueError: it is no condition, or names what the case does not have.
    """
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f"must read like 'v_pu.B8 < 0.8 for 0.1 s' (got {text!r})")
    name, sign, number, hold = match.groups()
    try:
        value = float(number)
    except ValueError as error:
        raise ValueError(f"must compare with a number (got {number!r})") from error
    if not np.isfinite(value):
        raise ValueError(f"must compare with a finite number (got {number!r})")
    hold_s = quantity(hold, "time") if hold else 0.0
    kind, _, element = name.partition(".")
    row = _row(kind, element, case, sensors)
    return Condition(kind, row, sign, value, round(hold_s * steps_per_second))


def _row(kind: str, element: str, case: Case, sensors: tuple[int, ...]) -> int:
    known = ["coi_pu", *UNIT_QUANTITIES, *BUS_QUANTITIES]
    if kind not in known:
        raise ValueError(f"no quantity '{kind}'{near(kind, known)} ({', '.join(known)})")
    if kind == "coi_pu":
        if element:
            raise ValueError("coi_pu stands alone, without an element")
        return 0
    if kind in UNIT_QUANTITIES:
        if element not in case.units:
            raise ValueError(f"no unit '{element}'{near(element, case.units)}")
        return case.units.index(element)
    buses = sensors if kind == "f_hz" else tuple(case.buses.number.tolist())
    names = [f"B{bus}" for bus in buses]
    if element not in names:
        what = "PMU at bus" if kind == "f_hz" else "bus"
        raise ValueError(f"no {what} '{element}'{near(element, names)}")
    return names.index(element)

"""The operating point as states: every model's equations run backwards from the power flow."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tieline.errors import NumericalError
from tieline.grid.case import Case
from tieline.grid.devices import Group
from tieline.grid.models.base import SIGNALS
from tieline.grid.models.limits import OutsideLimitError
from tieline.grid.powerflow import PowerFlow

Floats = NDArray[np.float64]

REST_TOLERANCE = 1e-8
"""Largest derivative at the initial point. The power flow's last Newton step leaves some 1e-12 pu,
which K_A / T_A of a static exciter, 1e4, turns into 1e-8 at worst."""


def initial_states(
    case: Case, flow: PowerFlow, found: Sequence[Group]
) -> tuple[list[Floats], Floats]:
    """Return the states (states, n) of each group and the signals (signals, units) at rest.

    Raises:
        NumericalError: a unit's operating point violates a limit or is not finite; names the unit.
    """
    signals = np.zeros((len(SIGNALS), len(case.units)))
    named = dict(zip(SIGNALS, signals, strict=True))
    v = flow.phasor[case.unit_bus]
    current = _unit_current(case, flow)
    named["v_re"][:], named["v_im"][:], named["vt"][:] = v.real, v.imag, np.abs(v)
    named["i_re"][:], named["i_im"][:] = current.real, current.imag
    named["Pe"][:] = (v * current.conj()).real
    for name in ("omega", "wbar", "w0"):
        named[name][:] = 1.0
    named["w_s"][:] = 2.0 * np.pi * case.base.frequency_Hz
    states = []
    for group in found:
        local = {name: row[group.units] for name, row in named.items()}
        states.append(_at_rest(case, group, local))
        for name, row in named.items():
            row[group.units] = local[name]
    return states, signals


def _at_rest(case: Case, group: Group, local: dict[str, Floats]) -> Floats:
    try:
        # What overflows is found below, as a state that is not finite.
        with np.errstate(all="ignore"):
            x = np.ascontiguousarray(group.model.initialise(local, group.p))
    except OutsideLimitError as error:
        unit = case.units[group.units[error.position]]
        raise NumericalError(f"{group.model.key} of '{unit}': {error}") from error
    for row, column in np.argwhere(~np.isfinite(x)):
        unit = case.units[group.units[column]]
        raise NumericalError(
            f"{group.model.key} of '{unit}': {group.model.states[row]} is not finite at the start"
        )
    return x


def _unit_current(case: Case, flow: PowerFlow) -> NDArray[np.complex128]:
    """Return (units,) terminal currents on machine base; units of a bus share it by rating."""
    rating_at_bus = np.bincount(case.unit_bus, case.unit_MVA, minlength=len(flow.v))
    share = case.unit_MVA / rating_at_bus[case.unit_bus]
    power = (flow.p_gen + 1j * flow.q_gen)[case.unit_bus] * share
    per_machine_base = power * case.base.base_MVA / case.unit_MVA
    return np.asarray((per_machine_base / flow.phasor[case.unit_bus]).conj())


def require_rest(dx: Floats, labels: Sequence[str]) -> None:
    """Raise unless every derivative at the initial point is below `REST_TOLERANCE`.

    Raises:
        NumericalError: one is not; names the state with the largest.
    """
    worst = int(np.argmax(np.abs(dx)))
    if not abs(dx[worst]) < REST_TOLERANCE:
        raise NumericalError(
            f"the system is not at rest at the start: d({labels[worst]})/dt = {dx[worst]:.3g}, "
            f"allowed {REST_TOLERANCE:g}"
        )

"""Another mix of constant power, current and impedance in every load of a case."""

from dataclasses import replace

import numpy as np

from tieline.grid.case import Case, Loads
from tieline.grid.settings import LoadSettings


def with_load_mix(case: Case, settings: LoadSettings | None) -> Case:
    """Return the case with every load composed as an experiment says; HVDC terminals stay.

    Buses whose load is constant impedance in the case are included. The power flow is the same:
    a mix says how a load answers to voltage and frequency, not how large it is.
    """
    if settings is None:
        return case
    hvdc = case.loads.bus[case.loads.is_hvdc]
    loaded = np.flatnonzero((case.buses.p_load != 0) | (case.buses.q_load != 0))
    plain = np.setdiff1d(loaded, hvdc)
    keep = case.loads.is_hvdc

    def shares(kept: np.ndarray, given: float) -> np.ndarray:
        return np.concatenate([kept[keep], np.full(len(plain), given)])

    mix = Loads(
        bus=np.concatenate([hvdc, plain]),
        p_constant_power=shares(case.loads.p_constant_power, settings.p_constant_power),
        p_constant_current=shares(case.loads.p_constant_current, settings.p_constant_current),
        q_constant_power=shares(case.loads.q_constant_power, settings.q_constant_power),
        q_constant_current=shares(case.loads.q_constant_current, settings.q_constant_current),
        p_frequency=shares(case.loads.p_frequency, settings.p_frequency),
        q_frequency=shares(case.loads.q_frequency, settings.q_frequency),
        is_hvdc=np.concatenate([keep[keep], np.zeros(len(plain), dtype=bool)]),
    )
    return replace(case, loads=mix)

"""Which device stands where: the case's tables with the experiment's stabilisers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tieline.grid.case import Case
from tieline.grid.device_tables import Device
from tieline.grid.models.base import ROLES, Model
from tieline.grid.stabilisers import with_pss

__all__ = ["Group", "groups", "with_pss"]


@dataclass(frozen=True)
class Group:
    """All units with one model: `units` (n,) rows of the case's units, `p` (parameters, n)."""

    role: str
    model: type[Model]
    units: NDArray[np.int64]
    p: NDArray[np.float64]


def groups(case: Case, substitute: Mapping[type[Model], type[Model]]) -> list[Group]:
    """Return the groups of equal model, roles in the order of `ROLES`.

    Args:
        case: with the stabilisers of the experiment.
        substitute: models to put in place of others that have the same parameters.
    """
    found = []
    for role in ROLES:
        by_model: dict[type[Model], list[Device]] = {}
        for device in case.devices[role]:
            by_model.setdefault(substitute.get(device.model, device.model), []).append(device)
        for model, devices in by_model.items():
            values = [[d.values[p.symbol] for d in devices] for p in model.parameters]
            units = np.array([case.units.index(d.unit) for d in devices], np.int64)
            found.append(Group(role, model, units, np.array(values, np.float64)))
    return found

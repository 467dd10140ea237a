"""Which device stands where: the case's tables with the experiment's stabilisers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.grid.case import Case, Device, describe_violation
from tieline.grid.models.base import ROLES, Model
from tieline.grid.models.pss.delta_omega import DeltaOmega
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega
from tieline.grid.settings import PssSettings
from tieline.grid.tables import near

PSS_MODELS: Mapping[str, type[Model]] = {
    "standard": DeltaOmega,
    "generalized": GeneralizedDeltaOmega,
}


@dataclass(frozen=True)
class Group:
    """All units with one model: `units` (n,) rows of the case's units, `p` (parameters, n)."""

    role: str
    model: type[Model]
    units: NDArray[np.int64]
    p: NDArray[np.float64]


def with_pss(case: Case, settings: PssSettings) -> Case:
    """Return the case with the stabilisers that an experiment asks for.

    Raises:
        InputError: a unit is unknown, has no exciter or no stabiliser data, or a parameter is
            outside its bounds.
    """
    if settings.model == "none":
        return replace(case, devices={**case.devices, "pss": ()})
    wanted = case.units if settings.units == "all" else tuple(settings.units)
    findings = _unknown_units(case, wanted)
    model = PSS_MODELS[settings.model]
    chosen = []
    for device in case.devices["pss"]:
        if device.unit in wanted:
            values = {**device.values, "beta1": settings.beta1, "beta2": settings.beta2}
            if settings.gain is not None:
                values["K"] = settings.gain
            values = {p.symbol: values[p.symbol] for p in model.parameters if p.symbol in values}
            findings += _check(model, device.unit, values)
            chosen.append(replace(device, model=model, values=values))
    if settings.units != "all":
        fitted = {device.unit for device in chosen}
        for unit in wanted:
            if unit in case.units and unit not in fitted:
                findings.append(_why_not(case, unit))
    if findings:
        raise InputError(findings)
    return replace(case, devices={**case.devices, "pss": tuple(chosen)})


def _unknown_units(case: Case, wanted: tuple[str, ...]) -> list[str]:
    return [
        f"grid.pss.units: no unit '{unit}'{near(unit, case.units)}"
        for unit in wanted
        if unit not in case.units
    ]


def _why_not(case: Case, unit: str) -> str:
    if case.device("exciter", unit) is None:
        return f"grid.pss.units: unit '{unit}' has no exciter, so a PSS cannot act on it"
    return f"grid.pss.units: unit '{unit}' has no row in {case.name}/pss.csv"


def _check(model: type[Model], unit: str, values: Mapping[str, float]) -> list[str]:
    missing = [p.symbol for p in model.parameters if p.symbol not in values]
    if missing:
        return [f"{model.key} of '{unit}' lacks {', '.join(missing)}"]
    return [
        f"grid.pss: {describe_violation(model, unit, p.symbol, values[p.symbol])}"
        for p in model.parameters
        if not p.allows(values[p.symbol])
    ]


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

"""Puts the stabilisers that an experiment asks for in place of the case's own."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.device_tables import Device, violations
from tieline.grid.models.base import Model
from tieline.grid.models.registry import models
from tieline.grid.pss_settings import ALIASES, NONE, OF_THE_CASE, PssSettings
from tieline.grid.tables import near

WHOLE_BETA = 1.0


def with_pss(case: Case, settings: PssSettings) -> Case:
    """Return the case with the stabilisers that an experiment asks for.

    Raises:
        InputError: a unit, model or parameter is unknown, a unit has no exciter or no stabiliser
            data, a parameter is missing or outside its bounds; every finding.
    """
    wanted = case.units if settings.units == "all" else tuple(settings.units)
    findings = [*_unknown_units(case, "units", wanted)]
    fitted: list[Device] = []
    if settings.model != NONE:
        fitted = [_fitted(d, settings) for d in case.devices["pss"] if d.unit in wanted]
        findings += _out_of_service(case, settings, [device.unit for device in fitted])
        findings += _unknown_symbols(settings, fitted)
        findings += _missing(case, fitted)
        for device in fitted:
            findings += _violations(device)
    if findings:
        raise InputError(findings)
    return replace(case, devices={**case.devices, "pss": tuple(fitted)})


def _fitted(device: Device, settings: PssSettings) -> Device:
    """Return a unit's device with the model and the values that hold, as far as there are any."""
    model = device.model if settings.model == OF_THE_CASE else _named(settings.model)
    values = {p.symbol: p.default for p in model.parameters if p.default is not None}
    values |= {"beta1": WHOLE_BETA, "beta2": WHOLE_BETA, **device.values}
    given = {"K": settings.gain, "beta1": settings.beta1, "beta2": settings.beta2}
    values |= {symbol: value for symbol, value in given.items() if value is not None}
    values |= settings.parameters | settings.tuning.get(device.unit, {})
    own = {p.symbol: values[p.symbol] for p in model.parameters if p.symbol in values}
    return replace(device, model=model, values=own)


def _named(name: str) -> type[Model]:
    """Return the model of a name.

    Raises:
        InputError: there is none; the message gives the nearest.
    """
    known = models("pss")
    key = ALIASES.get(name, name)
    if key not in known:
        words = [NONE, *ALIASES, OF_THE_CASE, *known]
        raise InputError(
            f"grid.pss.model: no model '{name}'{near(name, words)} (known: {', '.join(words)})"
        )
    return known[key]


def _unknown_units(case: Case, key: str, named: Iterable[str]) -> list[str]:
    return [
        f"grid.pss.{key}: no unit '{unit}'{near(unit, case.units)}"
        for unit in named
        if unit not in case.units
    ]


def _out_of_service(case: Case, settings: PssSettings, fitted: list[str]) -> list[str]:
    """Return a finding for each unit that is named but cannot or shall not have a stabiliser."""
    findings = _unknown_units(case, "tuning", settings.tuning)
    named = () if settings.units == "all" else settings.units
    for unit in named:
        if unit in case.units and unit not in fitted:
            findings.append(f"grid.pss.units: unit '{unit}' {_why_not(case, unit)}")
    for unit in settings.tuning:
        if unit in case.units and unit not in fitted and unit not in named:
            out = settings.units != "all" and case.device("pss", unit) is not None
            reason = "is not among grid.pss.units" if out else _why_not(case, unit)
            findings.append(f"grid.pss.tuning.{unit}: unit '{unit}' {reason}")
    return findings


def _why_not(case: Case, unit: str) -> str:
    if case.device("exciter", unit) is None:
        return "has no exciter, so a PSS cannot act on it"
    return f"has no row in {case.name}/pss.csv"


def _unknown_symbols(settings: PssSettings, fitted: list[Device]) -> list[str]:
    """Return a finding for each parameter that is given but that no model it is meant for has."""
    of_unit = {device.unit: device.model for device in fitted}
    used = list(dict.fromkeys(of_unit.values()))
    findings = _unknown("grid.pss.parameters", settings.parameters, used)
    for unit, values in settings.tuning.items():
        if unit in of_unit:
            findings += _unknown(f"grid.pss.tuning.{unit}", values, [of_unit[unit]])
    for key, symbol in (("gain", "K"), ("beta1", "beta1"), ("beta2", "beta2")):
        is_alone = settings.model not in (OF_THE_CASE, *ALIASES)
        if is_alone and getattr(settings, key) is not None:
            findings += _unknown(f"grid.pss.{key}", {symbol: 0.0}, used)
    return findings


def _unknown(where: str, values: Mapping[str, float], used: list[type[Model]]) -> list[str]:
    known = list(dict.fromkeys(p.symbol for model in used for p in model.parameters))
    keys = " and ".join(model.key for model in used)
    return [
        f"{where}: {keys} has no parameter '{symbol}'{_near(symbol, known)} ({', '.join(known)})"
        for symbol in values
        if used and symbol not in known
    ]


def _near(symbol: str, known: list[str]) -> str:
    """Return the hint at the nearest symbol; Tw for TW, which differs in half of its letters."""
    of_lower = {word.lower(): word for word in known}
    same = of_lower.get(symbol.lower())
    return f"; did you mean '{same}'?" if same else near(symbol, known)


def _missing(case: Case, fitted: list[Device]) -> list[str]:
    """Return one finding for all units that lack the same parameters."""
    units: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for device in fitted:
        missing = tuple(p.symbol for p in device.model.parameters if p.symbol not in device.values)
        if missing:
            units.setdefault((device.model.key, missing), []).append(device.unit)
    return [
        f"grid.pss.parameters: {key} of {_list(lacking)} needs {', '.join(missing)}, which "
        f"{case.name}/pss.csv does not give"
        for (key, missing), lacking in units.items()
    ]


def _list(units: list[str]) -> str:
    return f"'{units[0]}'" if len(units) == 1 else f"'{units[0]}' and {len(units) - 1} more"


def _violations(device: Device) -> list[str]:
    if len(device.values) < len(device.model.parameters):
        return []
    return [f"grid.pss: {text}" for text in violations(device.model, device.unit, device.values)]

"""Other parameters in a system that is at rest already, where they do not move the rest."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tieline.errors import InputError
from tieline.grid.models.base import Parameter
from tieline.grid.system import System
from tieline.grid.tables import near


def retuned(
    system: System, role: str, changes: Mapping[str, float], units: Sequence[str] | None = None
) -> System:
    """Return the system with other parameters in devices whose rest does not depend on them.

    Stabilisers are such devices: at synchronous speed they give nothing, whatever their gain.

    Args:
        system: at rest.
        role: `pss`, or another role for parameters known to leave the rest alone.
        changes: new values by symbol.
        units: units whose devices change; None for all that have the parameters.

    Raises:
        InputError: no device has a parameter, a value is out of bounds, or a unit has no such
            device.
    """
    parameters = system.plan.jobs.parameters.copy()
    places = np.cumsum([0, *(group.p.size for group in system.groups)])
    found, done = [], set()
    for group, start in zip(system.groups, places[:-1], strict=True):
        symbols = [parameter.symbol for parameter in group.model.parameters]
        p = group.p.copy()
        names = [system.case.units[unit] for unit in group.units]
        columns = [i for i, name in enumerate(names) if units is None or name in units]
        if group.role == role and columns:
            for symbol in set(changes) & set(symbols):
                row = symbols.index(symbol)
                _check(group.model.parameters[row], changes[symbol])
                p[row, columns] = changes[symbol]
                done |= {(symbol, names[i]) for i in columns}
            parameters[start : start + p.size] = p.ravel()
        found.append(replace(group, p=p))
    known = sorted(
        {
            parameter.symbol
            for group in system.groups
            if group.role == role
            for parameter in group.model.parameters
        }
    )
    for symbol in changes:
        if symbol not in known:
            raise InputError(f"no {role} has a parameter '{symbol}'{near(symbol, known)}")
        for unit in units or ():
            if (symbol, unit) not in done:
                raise InputError(f"unit '{unit}' has no {role} with a parameter '{symbol}'")
    jobs = system.plan.jobs._replace(parameters=parameters)
    return replace(system, groups=tuple(found), plan=system.plan._replace(jobs=jobs))


def _check(parameter: Parameter, value: float) -> None:
    if not parameter.allows(value):
        raise InputError(f"'{parameter.symbol}' must be {parameter.bounds} (got {value:g})")

"""What may be wrong between the parameters of one unit, in the words of `Model.check`."""

from collections.abc import Mapping


def order(values: Mapping[str, float], low: str, high: str) -> list[str]:
    """Return a finding unless values[low] < values[high]."""
    if values[low] < values[high]:
        return []
    return [f"needs {low} < {high} (got {values[low]:g} and {values[high]:g})"]


def saturation(values: Mapping[str, float], E1: str, S1: str, E2: str, S2: str) -> list[str]:
    """Return findings unless two points make a saturation curve with a knee at or above zero."""
    findings = order(values, E1, E2)
    if not findings and values[S1] * values[E2] > values[S2] * values[E1]:
        findings.append(
            f"needs {S1}/{E1} <= {S2}/{E2}: saturation grows at least in proportion "
            f"(got {values[S1]:g}/{values[E1]:g} and {values[S2]:g}/{values[E2]:g})"
        )
    return findings

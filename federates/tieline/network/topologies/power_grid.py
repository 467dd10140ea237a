"""What a communication network needs to know of a power grid, and no more."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Bus:
    """A bus; `area` groups buses for regional networks."""

    number: int
    base_kv: float
    area: str = ""


@dataclass(frozen=True)
class Branch:
    """A line or transformer between two bus numbers, impedance on the system base."""

    start: int
    end: int
    resistance_pu: float
    reactance_pu: float
    kind: str = "line"


@dataclass(frozen=True)
class PowerGrid:
    """A case, as far as it decides where fibre lies.

    Attributes:
        name: the case's.
        base_mva: system base of the impedances.
        areas: in the case's order.
        pmus: bus number of each PMU.
        controllers: (unit, bus number) of each controller.
    """

    name: str
    base_mva: float
    areas: tuple[str, ...]
    buses: tuple[Bus, ...]
    branches: tuple[Branch, ...]
    pmus: tuple[int, ...] = ()
    controllers: tuple[tuple[str, int], ...] = ()

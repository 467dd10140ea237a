"""Distributions of delays, one a file; `JITTERS` are the names that a topology file may use."""

from typing import Annotated

from pydantic import Field

from tieline.network.entry import Entry
from tieline.network.jitter.base import Jitter
from tieline.network.jitter.constant import ConstantEntry, ConstantJitter
from tieline.network.jitter.empirical import EmpiricalEntry, EmpiricalJitter
from tieline.network.jitter.gamma import GammaEntry, GammaJitter
from tieline.network.jitter.normal import NormalEntry, NormalJitter
from tieline.network.jitter.uniform import UniformEntry, UniformJitter

__all__ = [
    "JITTERS",
    "ConstantJitter",
    "EmpiricalJitter",
    "GammaJitter",
    "Jitter",
    "JitterEntry",
    "NormalJitter",
    "UniformJitter",
]

JITTERS: dict[str, type[Entry]] = {
    "constant": ConstantEntry,
    "uniform": UniformEntry,
    "normal": NormalEntry,
    "gamma": GammaEntry,
    "empirical": EmpiricalEntry,
}
JitterEntry = Annotated[
    ConstantEntry | UniformEntry | NormalEntry | GammaEntry | EmpiricalEntry,
    Field(discriminator="distribution"),
]

"""What an experiment says about the grid."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, model_validator

from tieline.grid.event_settings import Event
from tieline.grid.pss_settings import PssSettings
from tieline.units import PerSecond, Seconds, Share, Unit

STEEPEST_LOAD = 20.0
"""Largest answer of a load to frequency, pu/pu; measured ones are far below."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Part = Annotated[Share, Field(ge=0, le=1)]
Slope = Annotated[StrictFloat, Field(ge=-STEEPEST_LOAD, le=STEEPEST_LOAD), Unit("pu/pu")]


class LoadSettings(_Strict):
    """How every load answers to voltage and frequency, in place of what the case says.

    What is neither constant power nor constant current is constant impedance.
    """

    p_constant_power: Part = Field(0.0, description="share of active power that is constant power")
    p_constant_current: Part = Field(
        0.0, description="share of active power that is constant current"
    )
    q_constant_power: Part = Field(
        0.0, description="share of reactive power that is constant power"
    )
    q_constant_current: Part = Field(
        0.0, description="share of reactive power that is constant current"
    )
    p_frequency: Slope = Field(0.0, description="answer of active power to frequency")
    q_frequency: Slope = Field(0.0, description="answer of reactive power to frequency")

    @model_validator(mode="after")
    def _leave_room(self) -> Self:
        for letter in "pq":
            parts = [getattr(self, f"{letter}_constant_{of}") for of in ("power", "current")]
            if sum(parts) > 1:
                raise ValueError(f"shares of {letter} must sum to 1 at most (got {parts})")
        return self


class GridSettings(_Strict):
    """Duration, integration and disturbances."""

    duration: Seconds = Field(41.0, gt=0, le=86_400, description="simulated time")
    method: Literal["rk4", "rk3", "heun", "trapezoid"] = Field(
        "rk4",
        description=(
            "integration method, of order 4, 3, 2 and 2; trapezoid, the implicit one, stands stiff"
            " parameters and steps as long as 1/60 s"
        ),
    )
    steps_per_second: PerSecond = Field(
        240, gt=0, le=100_000, description="integration steps a second"
    )
    records_per_second: PerSecond = Field(
        60, gt=0, le=100_000, description="recorded instants a second, a divisor of the steps"
    )
    pss: PssSettings = Field(
        PssSettings(),  # type: ignore[call-arg]
        description="the stabilisers and their tuning",
    )
    loads: LoadSettings | None = Field(None, description="mix of every load; none keeps the case's")
    events: list[Event] = Field([], description="disturbances, in any order")

"""What an experiment says about the phasor measurements and the average made of them."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, StrictInt

from tieline.units import PerSecond, Unit

BusNumber = Annotated[StrictInt, Field(ge=1, le=999_999_999), Unit("number")]
Weight = Annotated[StrictFloat, Field(ge=0, le=1e9), Unit("1")]


class WamsSettings(BaseModel):
    """Reporting, sensors and weights."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    reporting: Annotated[PerSecond, Field(gt=0, le=240)] | Literal["continuous"] = Field(
        60,
        description=(
            "frames a second of each PMU, or 'continuous': the average is formed at every "
            "integration step and delayed as a whole (engines ideal and constant only)"
        ),
    )
    sensors: Literal["default"] | Annotated[list[BusNumber], Field(min_length=1)] = Field(
        "default", description="bus numbers that carry a PMU, or the case's own list"
    )
    weights: Literal["equal", "H", "H_MVA"] | list[Weight] = Field(
        "equal",
        description=(
            "weight of each sensor in wbar (of each rotor with grid.pss.average: rotors), scaled "
            "to sum 1: equal; the inertia constant H of the units next to it; H times their "
            "rating; or a list. When a unit trips, a continuous average by H or H_MVA, and any of "
            "rotors, drops it; controllers that live on frames cannot know and keep their weights"
        ),
    )

"""What an experiment says about the phasor measurements and the average made of them."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class WamsSettings(BaseModel):
    """Reporting, sensors and weights."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    reporting: int | Literal["continuous"] = Field(
        60,
        description=(
            "frames a second of each PMU, or 'continuous': the average is formed at every "
            "integration step and delayed as a whole (engines ideal and constant only)"
        ),
    )
    sensors: Literal["default"] | list[int] = Field(
        "default", description="bus numbers that carry a PMU, or the case's own list"
    )
    weights: Literal["equal"] | list[float] = Field(
        "equal", description="weight of each sensor in wbar; scaled to sum 1"
    )

"""What an experiment says about the grid."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from tieline.units import Seconds


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PssSettings(_Strict):
    """The stabilisers and their tuning."""

    model: Literal["none", "standard", "generalized"] = Field(
        "generalized",
        description="none; the standard delta-omega PSS; the generalised one with beta1 and beta2",
    )
    gain: float | None = Field(
        None, ge=0, description="gain K, pu on the machine's base; none takes the case's own"
    )
    beta1: float = Field(1.0, ge=0, le=1, description="share of the speed against the average")
    beta2: float = Field(1.0, ge=0, le=1, description="share of the average against synchronous")
    average: Literal["sensors", "rotors"] = Field(
        "sensors", description="wbar from PMU frequencies, or from the true rotor speeds (undelayed)"
    )
    units: Literal["all"] | list[str] = Field(
        "all", description="units whose stabiliser is in service, by name (G1, G2, ...)"
    )


class TripGenerator(_Strict):
    """A unit's step-up branch opens; the unit goes on alone behind it."""

    at: Seconds = Field(ge=0, description="instant of the event, s")
    trip_generator: str = Field(description="name of the unit")


class TripBranch(_Strict):
    """A branch opens at both ends."""

    at: Seconds = Field(ge=0, description="instant of the event, s")
    trip_branch: str = Field(description="FROM-TO bus numbers, with #N for the Nth parallel circuit")


Event = Annotated[TripGenerator | TripBranch, Field(description="a disturbance")]


class GridSettings(_Strict):
    """Duration, integration and disturbances."""

    duration: Seconds = Field(41.0, gt=0, description="simulated time, s")
    method: Literal["rk4", "heun"] = Field("rk4", description="integration method")
    steps_per_second: int = Field(240, gt=0, le=100_000, description="integration steps a second")
    records_per_second: int = Field(60, gt=0, description="recorded instants a second")
    pss: PssSettings = PssSettings()  # type: ignore[call-arg]
    events: list[Event] = Field(default_factory=list, description="disturbances, in any order")

"""What an experiment says about the grid."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, StrictFloat, StrictInt, Tag

from tieline.units import Seconds


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PssSettings(_Strict):
    """The stabilisers and their tuning."""

    model: Literal["none", "standard", "generalized"] = Field(
        "generalized",
        description="none; the standard delta-omega PSS; the generalised one with beta1 and beta2",
    )
    gain: StrictFloat | None = Field(
        None, ge=0, description="gain K, pu on the machine's base; none takes the case's own"
    )
    beta1: StrictFloat = Field(
        1.0, ge=0, le=1, description="share of the speed against the average"
    )
    beta2: StrictFloat = Field(
        1.0, ge=0, le=1, description="share of the average against synchronous"
    )
    average: Literal["sensors", "rotors"] = Field(
        "sensors",
        description="wbar from PMU frequencies, or from the true rotor speeds (undelayed)",
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
    trip_branch: str = Field(
        description="FROM-TO bus numbers, with #N for the Nth parallel circuit"
    )


_KINDS = ("trip_generator", "trip_branch")


def _kind(event: Any) -> str | None:
    keys = event if isinstance(event, dict) else vars(event) if isinstance(event, BaseModel) else ()
    named = [kind for kind in _KINDS if kind in keys]
    return named[0] if len(named) == 1 else None


Event = Annotated[
    Annotated[TripGenerator, Tag("trip_generator")] | Annotated[TripBranch, Tag("trip_branch")],
    Discriminator(_kind),
    Field(description="a disturbance: its instant `at`, and what it trips"),
]


class GridSettings(_Strict):
    """Duration, integration and disturbances."""

    duration: Seconds = Field(41.0, gt=0, le=86_400, description="simulated time, s")
    method: Literal["rk4", "heun"] = Field("rk4", description="integration method")
    steps_per_second: StrictInt = Field(
        240, gt=0, le=100_000, description="integration steps a second"
    )
    records_per_second: StrictInt = Field(60, gt=0, description="recorded instants a second")
    pss: PssSettings = PssSettings()  # type: ignore[call-arg]
    events: list[Event] = Field(default_factory=list, description="disturbances, in any order")

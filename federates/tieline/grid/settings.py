"""What an experiment says about the grid."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, StrictInt

from tieline.grid.event_settings import Event
from tieline.grid.pss_settings import PssSettings
from tieline.units import Seconds


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


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

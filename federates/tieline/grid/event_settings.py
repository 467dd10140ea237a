"""What an experiment says about disturbances: one class a kind, told apart by its key."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, StrictFloat, StrictInt, Tag

from tieline.units import Megawatts, Seconds, Unit

Branch = Annotated[str, Field(min_length=1)]
BusNumber = Annotated[StrictInt, Field(ge=1, le=999_999_999), Unit("number")]
Step = Annotated[StrictFloat, Field(ge=-10, le=10), Unit("pu")]

_BRANCH = "as FROM-TO bus numbers, with #N for the Nth circuit"


class _Event(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    at: Seconds = Field(
        ge=0, le=86_400, description="instant of the event, with `when` its earliest"
    )
    when: str | None = Field(
        None,
        min_length=1,
        description=(
            "condition that must hold, such as 'f_hz.B61 < 59.7' or 'v_pu.B8 < 0.8 for 0.1 s'; "
            "the event then happens once, at the first step at which it has held so long"
        ),
    )


class TripGenerator(_Event):
    """A unit's step-up branch opens; the unit goes on alone behind it."""

    trip_generator: str = Field(min_length=1, description="name of the unit that trips")


class TripBranch(_Event):
    """A branch opens at both ends; it may close again."""

    trip_branch: Branch = Field(description=f"the branch that opens, {_BRANCH}")
    reclose_after: Seconds | None = Field(
        None, gt=0, le=86_400, description="time until it closes again; none leaves it open"
    )


class CloseBranch(_Event):
    """An open branch closes."""

    close_branch: Branch = Field(description=f"the branch that closes, {_BRANCH}")


class Fault(_Event):
    """A three-phase fault at a bus, cleared with or without the loss of a branch.

    With `trip` the near end opens after `clear_after` and takes the fault off the bus; the far end
    feeds it through the branch until `far_clear_after`. Without, the fault goes out by itself.
    """

    fault_bus: BusNumber = Field(description="number of the bus that is short-circuited")
    clear_after: Seconds = Field(gt=0, le=60, description="duration at the bus")
    trip: Branch | None = Field(
        None, description=f"branch at the bus that is opened to clear it, {_BRANCH}"
    )
    far_clear_after: Seconds | None = Field(
        None, gt=0, le=60, description="until the far end opens; none opens both ends at once"
    )


class Brake(_Event):
    """A resistor is switched to a bus for some time."""

    brake_bus: BusNumber = Field(description="number of the bus that the resistor is switched to")
    size_MW: Megawatts = Field(gt=0, le=1e6, description="power that it takes at 1 pu voltage")
    duration: Seconds = Field(gt=0, le=86_400, description="time in service")


class ScaleLoad(_Event):
    """Load steps up or down, or is shed."""

    scale_load: BusNumber | list[BusNumber] | Literal["all"] = Field(
        description="numbers of the buses whose load steps, or all"
    )
    factor: Annotated[StrictFloat, Unit("1")] = Field(
        ge=0, le=10, description="factor on the load as the case has it; 0 sheds all"
    )


class StepReference(_Event):
    """A set-point steps."""

    step_reference: str = Field(min_length=1, description="name of the unit whose set-point steps")
    Vref: Step = Field(0.0, description="change of the exciter's reference")
    Pref: Step = Field(0.0, description="change of the governor's reference, on the machine base")


class ModulateHVDC(_Event):
    """A constant-current terminal's power order steps."""

    modulate_hvdc: BusNumber = Field(description="bus number of the terminal")
    power_MW: Megawatts = Field(ge=-1e6, le=1e6, description="change of the power that it draws")


class BlockGovernor(_Event):
    """A governor stays as it is: its states stop."""

    block_governor: str | list[str] | Literal["all"] = Field(
        description="names of the units whose governor is blocked, or all"
    )


_CLASSES: dict[str, type[_Event]] = {
    "trip_generator": TripGenerator,
    "trip_branch": TripBranch,
    "close_branch": CloseBranch,
    "fault_bus": Fault,
    "brake_bus": Brake,
    "scale_load": ScaleLoad,
    "step_reference": StepReference,
    "modulate_hvdc": ModulateHVDC,
    "block_governor": BlockGovernor,
}
KINDS = tuple(_CLASSES)


def _kind(event: Any) -> str | None:
    keys = event if isinstance(event, dict) else vars(event) if isinstance(event, BaseModel) else ()
    named = [kind for kind in KINDS if kind in keys]
    return named[0] if len(named) == 1 else None


Event = Annotated[
    Annotated[TripGenerator, Tag("trip_generator")]
    | Annotated[TripBranch, Tag("trip_branch")]
    | Annotated[CloseBranch, Tag("close_branch")]
    | Annotated[Fault, Tag("fault_bus")]
    | Annotated[Brake, Tag("brake_bus")]
    | Annotated[ScaleLoad, Tag("scale_load")]
    | Annotated[StepReference, Tag("step_reference")]
    | Annotated[ModulateHVDC, Tag("modulate_hvdc")]
    | Annotated[BlockGovernor, Tag("block_governor")],
    Discriminator(_kind),
    Field(description="a disturbance: its instant `at`, and what it does"),
]

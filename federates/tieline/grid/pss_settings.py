"""What an experiment says about the power system stabilisers."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, ValidationInfo, field_validator

from tieline.grid.plugins import installed_keys, shipped_keys
from tieline.grid.tables import near
from tieline.units import Unit

ALIASES = {"standard": "delta_omega", "generalized": "generalized_delta_omega"}
NONE, OF_THE_CASE = "none", "case"

PerUnit = Annotated[StrictFloat, Unit("pu")]
OwnUnit = Annotated[StrictFloat, Unit("the model's")]
"""A parameter's value; unit and bounds are those that its model declares (`tieline models`)."""


class PssSettings(BaseModel):
    """The stabilisers and their tuning.

    A parameter's value is looked for in `tuning` of the unit, `parameters`, `gain`, `beta1` and
    `beta2`, the unit's row of the case's pss.csv (a column that the model has too), and the
    default that the model declares, in this order.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    file: str | None = Field(
        None,
        min_length=1,
        description="a Python file with models of one's own; it counts from the experiment's file",
    )
    model: str = Field(
        "generalized",
        min_length=1,
        description="none; case, each unit's own of pss.csv; standard or generalized, the "
        "delta-omega PSS without and with beta1 and beta2; or any other model by its name",
    )
    gain: PerUnit | None = Field(
        None,
        ge=0,
        le=1e6,
        description="gain K, on the machine's base; none takes the case's own",
    )
    beta1: PerUnit | None = Field(
        None,
        ge=0,
        le=1,
        description="share of the speed against the average; none takes the case's own, or 1",
    )
    beta2: PerUnit | None = Field(
        None,
        ge=0,
        le=1,
        description="share of the average against synchronous; none takes the case's own, or 1",
    )
    parameters: dict[str, OwnUnit] = Field(
        {}, description="parameters of every unit's model by symbol, as {T1: 0.2}"
    )
    tuning: dict[str, dict[str, OwnUnit]] = Field(
        {}, description="parameters of single units, as {G3: {K: 5, T1: 0.2}}"
    )
    average: Literal["sensors", "rotors"] = Field(
        "sensors",
        description="wbar from PMU frequencies, or from the true rotor speeds (undelayed)",
    )
    units: Literal["all"] | list[str] = Field(
        "all", description="units whose stabiliser is in service, by name (G1, G2, ...)"
    )

    @field_validator("model")
    @classmethod
    def _is_known(cls, value: str, info: ValidationInfo) -> str:
        """Refuse an unknown name at once, unless a file may bring it."""
        if value in (NONE, OF_THE_CASE, *ALIASES):
            return value
        known = [NONE, *ALIASES, OF_THE_CASE, *shipped_keys("pss"), *installed_keys("pss")]
        if info.data.get("file") is None and value not in known:
            raise ValueError(
                f"must be one of {', '.join(known)} (got '{value}'{near(value, known)}; "
                "grid.pss.file brings models of one's own)"
            )
        return value

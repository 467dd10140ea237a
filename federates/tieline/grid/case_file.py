"""case.yaml: bases, areas, default sensors and what summaries look at."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StrictFloat, StrictInt, StrictStr

from tieline import yaml_lines
from tieline.errors import InputError
from tieline.grid.tables import Findings
from tieline.problems import checked

NAME = "case.yaml"


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _rising(band: tuple[float, float]) -> tuple[float, float]:
    if not 0.0 < band[0] < band[1]:
        raise ValueError(f"must be two rising frequencies above 0 (got {list(band)})")
    return band


class TieMode(_Strict):
    """Two groups of units whose swing against each other a summary reports."""

    units: tuple[StrictStr, ...] = Field(min_length=1)
    against: tuple[StrictStr, ...] = Field(min_length=1)
    band_Hz: Annotated[tuple[StrictFloat, StrictFloat], AfterValidator(_rising)]


class CaseFile(_Strict):
    """What case.yaml says."""

    name: StrictStr = Field(min_length=1)
    title: StrictStr
    base_MVA: StrictFloat = Field(gt=0)
    frequency_Hz: Literal[50, 60]
    areas: tuple[StrictStr, ...] = Field(min_length=1)
    sensors: tuple[StrictInt, ...] = Field(min_length=1)
    tie_mode: TieMode | None = None
    plot_unit: StrictStr | None = None


@dataclass(frozen=True)
class LocatedCaseFile:
    """What a case.yaml says, and on which line."""

    content: CaseFile
    document: yaml_lines.Document

    def where(self, *position: str | int) -> str:
        """Return file and line of a value."""
        return f"{NAME}:{self.document.line(position)}"


def read_case_file(folder: Path, findings: Findings) -> LocatedCaseFile | None:
    """Return what the case.yaml of a folder says; findings and None if it cannot be used."""
    try:
        document = yaml_lines.load(folder / NAME)
    except InputError as error:
        findings.items += error.findings
        return None
    if not isinstance(document.data, dict):
        findings.add(f"{NAME}:1", f"must hold keys and values (got {document.data!r:.60})")
        return None
    content, problems = checked(CaseFile, document.data)
    for problem in problems:
        findings.add(f"{NAME}:{document.line(problem.paths[0])}", problem.text)
    return None if content is None else LocatedCaseFile(content, document)


def check_case_file(
    file: LocatedCaseFile, buses: list[int] | None, units: list[str] | None, findings: Findings
) -> None:
    """Note buses and units that the tables do not have, and sensors named twice.

    Args:
        file: the case.yaml.
        buses, units: what the tables have; None where they could not be read whole.
        findings: takes them.
    """
    content = file.content
    for at, bus in enumerate(content.sensors):
        where = file.where("sensors", at)
        if bus in content.sensors[:at]:
            findings.add(where, f"sensors names bus {bus} twice")
        elif buses is not None:
            findings.known(where, "bus", bus, buses)
    if units is None:
        return
    tie = content.tie_mode
    for group in ("units", "against"):
        for at, unit in enumerate(getattr(tie, group, ())):
            findings.known(file.where("tie_mode", group, at), "unit", unit, units)
    if content.plot_unit is not None:
        findings.known(file.where("plot_unit"), "unit", content.plot_unit, units)

"""The shipped cases, each with its size and the networks that come with it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tieline import yaml_lines
from tieline.resources import shipped


@dataclass(frozen=True)
class CaseRow:
    """What one needs to know of a case in order to choose it.

    Attributes:
        name, title: as case.yaml has them.
        buses, units, sensors: how many; sensors are the buses with a PMU.
        networks: what `network.topology` may be called, `case` for the case's own.
    """

    name: str
    title: str
    buses: int
    units: int
    sensors: int
    networks: tuple[str, ...]

    def data(self) -> dict[str, Any]:
        """Return the row as JSON holds it."""
        return asdict(self)


def case_rows() -> list[CaseRow]:
    """Return the shipped cases in order of their names.

    Raises:
        InputError: a case is faulty.
    """
    # The case brings the compiled models with it, which other commands should not wait for.
    from tieline.grid.case import load_case

    rows = []
    for path in sorted(shipped("cases").glob("*/case.yaml")):
        case = load_case(path.parent)
        buses, sensors = len(case.buses.number), len(case.base.sensors)
        sizes = (buses, len(case.units), sensors)
        rows.append(CaseRow(case.name, case.base.title, *sizes, networks_of(path.parent)))
    return rows


def as_text(rows: Sequence[CaseRow]) -> str:
    """Return a table, one line a case."""
    cells = [("case", "buses", "units", "PMUs", "networks", "title")]
    for row in rows:
        sizes = (str(row.buses), str(row.units), str(row.sensors))
        cells.append((row.name, *sizes, ", ".join(row.networks) or "none", row.title))
    widths = [max(len(line[i]) for line in cells) for i in range(5)]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=False))
        + f"  {line[-1]}"
        for line in cells
    )


def networks_of(folder: Path) -> tuple[str, ...]:
    """Return the names of the topologies in a case's folder, its own first."""
    own = ("case",) if (folder / "network.yaml").is_file() else ()
    others = sorted(path for path in folder.glob("*.yaml") if path.stem not in ("case", "network"))
    return (*own, *(path.stem for path in others if _is_topology(path)))


def _is_topology(path: Path) -> bool:
    data = yaml_lines.load(path).data
    return isinstance(data, dict) and {"nodes", "links"} <= set(data)

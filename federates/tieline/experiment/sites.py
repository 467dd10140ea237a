"""Asks case and network whether an experiment can run, and which sites take part in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tieline.errors import InputError
from tieline.experiment.schema import Experiment

if TYPE_CHECKING:
    from tieline.grid.case import Case
    from tieline.network.spec import NetworkSpec


@dataclass(frozen=True)
class Sites:
    """What a run needs to know of its case.

    Attributes:
        sensors: bus of each PMU, in the order of its source number.
        controllers: (unit, bus) of each controller, in the order of its destination number.
        frequency_hz: nominal frequency.
        tie_mode: the swing that the summary reports, as case.yaml has it, or None.
        plot_unit: the unit whose voltage is drawn, or None.
        lookahead_ns: least time from a measurement until its frame does anything; None without
            frames.
        interconnection: what a drawing of it needs, as `interconnection` returns it, or None.
    """

    sensors: tuple[int, ...]
    controllers: tuple[tuple[str, int], ...]
    frequency_hz: float = 60.0
    tie_mode: Mapping[str, Any] | None = None
    plot_unit: str | None = None
    lookahead_ns: int | None = 0
    interconnection: Mapping[str, Any] | None = None

    def sources(self) -> list[dict[str, Any]]:
        """Return the PMUs as the run file lists them."""
        return [
            {"name": f"pmu{_padded(i, self.sensors)}", "bus": bus}
            for i, bus in enumerate(self.sensors)
        ]

    def destinations(self) -> list[dict[str, Any]]:
        """Return the controllers as the run file lists them."""
        return [
            {"name": f"ctl{_padded(i, self.controllers)}", "unit": unit, "bus": bus}
            for i, (unit, bus) in enumerate(self.controllers)
        ]


Survey = Callable[[Experiment, Path, Path | None], Sites]
"""Checks an experiment against a case folder and a topology file (or None)."""


Describe = Callable[["NetworkSpec | None"], Mapping[str, Any]]
"""Returns what a drawing of a case with a network needs."""


class Surveyor:
    """Checks experiments one after another; what the grid alone decides is looked at once."""

    def __init__(self) -> None:
        # The network brings networkx with it, which `tieline list` should not wait for.
        from tieline.network.topology import Networks

        self._networks = Networks()
        self._known: dict[str, tuple[Sites, tuple[str, ...], Describe]] = {}

    def __call__(self, experiment: Experiment, folder: Path, topology: Path | None) -> Sites:
        """Return the sites of an experiment, after every check against case and network.

        Args:
            experiment: checked by itself.
            folder: the case's.
            topology: the network's file, or None when the engine needs none.

        Raises:
            InputError: the case is malformed, the experiment names something that it lacks, its
                power flow diverges, or the network does not connect what it must.
        """
        sites, of_grid, describe = self._of_grid(experiment, folder)
        findings = list(of_grid)
        lookahead_ns, spec = None, None
        if sites.sensors and sites.controllers:
            sources, destinations = sites.sources(), sites.destinations()
            try:
                spec = self._networks.spec(experiment.network, topology, sources, destinations)
                lookahead_ns = spec.lookahead_ns
            except InputError as error:
                findings += error.findings
        if findings:
            raise InputError(findings)
        has_frames = experiment.wams.reporting != "continuous"
        return replace(
            sites,
            lookahead_ns=lookahead_ns if has_frames else None,
            interconnection=describe(None if topology is None else spec),
        )

    def _of_grid(
        self, experiment: Experiment, folder: Path
    ) -> tuple[Sites, tuple[str, ...], Describe]:
        parts = experiment.model_dump_json(include={"grid", "wams"})
        key = f"{folder} {parts}"
        if key not in self._known:
            self._known[key] = _grid_sites(experiment, folder)
        return self._known[key]


def _grid_sites(experiment: Experiment, folder: Path) -> tuple[Sites, tuple[str, ...], Describe]:
    """Return the sites as the case has them, what is wrong with what is asked, and what to draw."""
    # The case brings the compiled models with it, which `tieline list` should not wait for.
    from tieline.experiment.interconnection import interconnection
    from tieline.experiment.power_grid import power_grid_of
    from tieline.grid.case import load_case
    from tieline.grid.models.registry import use_file

    use_file("pss", experiment.grid.pss.file)
    case = load_case(folder)
    sensors, controllers, findings = _stations(case, experiment)
    tie_mode = case.base.tie_mode
    sites = Sites(
        sensors,
        controllers,
        float(case.base.frequency_Hz),
        None if tie_mode is None else tie_mode.model_dump(mode="json"),
        case.base.plot_unit,
    )
    buses = case.buses.number[case.unit_bus].tolist()
    units = list(zip(case.units, buses, strict=True))
    return sites, tuple(findings), partial(interconnection, power_grid_of(case), units)


def _stations(
    case: "Case", experiment: Experiment
) -> tuple[tuple[int, ...], tuple[tuple[str, int], ...], list[str]]:
    """Return PMUs, controllers and findings; with findings, the sites that do exist.

    So what is wrong with the network is reported together with what is wrong with the grid.
    """
    from tieline.grid.check import check, controllers, sensor_buses

    try:
        found = check(case, experiment.grid, experiment.wams)
    except InputError as error:
        units = experiment.grid.pss.units
        sensors = [b for b in sensor_buses(case, experiment.wams) if b in case.buses.number]
        fitted = [site for site in controllers(case) if units == "all" or site[0] in units]
        return tuple(sensors), tuple(fitted), list(error.findings)
    return found.sensors, found.controllers, []


def _padded(i: int, members: tuple[object, ...]) -> str:
    """Return a number with leading zeros: HELICS sorts messages of one instant by name."""
    return str(i).zfill(max(2, len(str(len(members) - 1))))

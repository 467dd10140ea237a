"""What an experiment file may say, and what must hold between its parts."""

import pathlib
from collections.abc import Iterator
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StrictInt

from tieline.cosim.interfaces import FederationSettings
from tieline.grid.settings import GridSettings
from tieline.network.findings import Findings
from tieline.network.schema import EventEntry
from tieline.network.settings import PACKET_ENGINES, NetworkSettings
from tieline.network.traffic import TRAFFIC
from tieline.problems import Path, Problem
from tieline.units import Unit
from tieline.wams.settings import WamsSettings
from tieline.yaml_lines import Document

CONTINUOUS_RATE_HZ = 60
"""Meetings of the federates a second when the average is formed at every integration step."""


class Experiment(BaseModel):
    """One run: what is simulated, with every setting in its place."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=80)] = Field(
        description="name of the experiment: letters, digits, _ and -"
    )
    question: str = Field(min_length=1, description="the question it answers, in one sentence")
    case: str = Field("miniwecc", min_length=1, description="a shipped case, or a case folder")
    seed: Annotated[StrictInt, Unit("number")] = Field(
        1, ge=0, lt=2**63, description="seed of every named random stream"
    )
    grid: GridSettings = Field(
        GridSettings(),  # type: ignore[call-arg]
        description="duration, integration, stabilisers, loads and disturbances",
    )
    wams: WamsSettings = Field(
        WamsSettings(),  # type: ignore[call-arg]
        description="the phasor measurements, and the average made of them",
    )
    network: NetworkSettings = Field(
        NetworkSettings(),  # type: ignore[call-arg]
        description="what carries the measurements, and what the experiment changes of it",
    )
    federation: FederationSettings = Field(
        FederationSettings(),  # type: ignore[call-arg]
        description="how the two federates meet",
    )

    @property
    def rate_hz(self) -> int:
        """Meetings of the federates a second: one a reporting interval."""
        reporting = self.wams.reporting
        return CONTINUOUS_RATE_HZ if reporting == "continuous" else reporting

    @property
    def intervals(self) -> int:
        """Reporting intervals in the run."""
        return round(self.grid.duration * self.rate_hz)


FIXED: frozenset[str] = frozenset({"name", "question", "extends", "sweep"})
"""Keys that belong to the whole experiment: no sweep point can change them."""


def contradictions(experiment: Experiment) -> list[Problem]:
    """Return what does not fit together in an experiment whose single values are right."""
    parts = (_timing, _average, _engine, _delay_line, _words)
    return [problem for part in parts for problem in part(experiment)]


def without_effect(experiment: Experiment) -> list[Problem]:
    """Return the network settings that are given but that the chosen engine does not read."""
    network = experiment.network
    readers = {
        "delay": ("constant", "helics-filters"),
        "mean_delay": PACKET_ENGINES,
        "jitter": PACKET_ENGINES,
        "loss": (*PACKET_ENGINES, "empirical", "helics-filters"),
        "empirical": ("empirical",),
    }
    return [
        Problem(
            (("network", key),),
            f"network.{key} has no effect with network.engine {network.engine}"
            f" (engine {' or '.join(engines)} reads it)",
        )
        for key, engines in readers.items()
        if getattr(network, key) is not None and network.engine not in engines
    ]


def _words(experiment: Experiment) -> Iterator[Problem]:
    """Yield what is wrong with traffic and events of the network in themselves.

    Whether the nodes that they name exist is for the topology to say, and where a trace's file is.
    """
    given = {"traffic": experiment.network.traffic, "events": experiment.network.events}
    for section, entries in given.items():
        for i, entry in enumerate(entries):
            findings = Findings(Document(pathlib.Path(), {section: list(entries)}, {}), "network.")
            if section == "events":
                findings.entry(entry, (section, i), EventEntry)
            elif entry.get("kind") != "trace":
                findings.tagged(entry, (section, i), "kind", TRAFFIC)
            for line in findings.lines():
                yield Problem((("network", section, i),), line)


def _timing(experiment: Experiment) -> Iterator[Problem]:
    grid, rate_hz = experiment.grid, experiment.rate_hz
    steps = grid.steps_per_second
    if steps % rate_hz:
        yield Problem(
            (("wams", "reporting"), ("grid", "steps_per_second")),
            f"grid.steps_per_second must be a multiple of the {rate_hz} reports a second of"
            f" wams.reporting (got {steps}; {_nearest_multiple(steps, rate_hz)} would do)",
        )
    if steps % grid.records_per_second:
        yield Problem(
            (("grid", "records_per_second"), ("grid", "steps_per_second")),
            f"grid.records_per_second must divide grid.steps_per_second {steps}"
            f" (got {grid.records_per_second}; {_nearest_divisor(grid.records_per_second, steps)}"
            " would do)",
        )
    if not _is_whole(grid.duration * rate_hz) or experiment.intervals < 1:
        nearest = max(1, experiment.intervals) / rate_hz
        yield Problem(
            (("grid", "duration"), ("wams", "reporting")),
            f"grid.duration must be a whole number of reporting intervals of 1/{rate_hz} s"
            f" (got {grid.duration:g} s; {nearest:g} s would do)",
        )


def _average(experiment: Experiment) -> Iterator[Problem]:
    wams = experiment.wams
    units = experiment.grid.pss.units
    yield from _repeated(("grid", "pss", "units"), [] if units == "all" else list(units))
    if wams.sensors != "default":
        yield from _repeated(("wams", "sensors"), list(wams.sensors))
    if isinstance(wams.weights, str):
        return
    if not any(wams.weights):
        yield Problem((("wams", "weights"),), "wams.weights must not all be 0")
    of_rotors = experiment.grid.pss.average == "rotors"
    if not of_rotors and wams.sensors != "default" and len(wams.weights) != len(wams.sensors):
        yield Problem(
            (("wams", "weights"), ("wams", "sensors")),
            f"wams.weights must have one weight for each of the {len(wams.sensors)} sensors"
            f" (got {len(wams.weights)})",
        )


def _engine(experiment: Experiment) -> Iterator[Problem]:
    network = experiment.network
    if experiment.wams.reporting == "continuous" and network.engine not in ("ideal", "constant"):
        yield Problem(
            (("wams", "reporting"), ("network", "engine")),
            "wams.reporting 'continuous' sends no frames, so it needs network.engine ideal or"
            f" constant (got {network.engine}); give frames a second, such as 60, for"
            f" {network.engine}",
        )
    if network.engine in ("constant", "helics-filters") and network.delay is None:
        yield Problem(
            (("network", "engine"), ("network", "delay")),
            f"network.engine {network.engine} needs network.delay, such as 250 ms (got none)",
        )
    if network.engine == "helics-filters" and network.delay == 0:
        yield Problem(
            (("network", "delay"), ("network", "engine")),
            "network.delay must be above 0 s with network.engine helics-filters (got 0 s;"
            " network.engine ideal has no delay)",
        )
    if network.engine == "empirical" and network.empirical is None:
        yield Problem(
            (("network", "engine"), ("network", "empirical")),
            "network.engine empirical needs network.empirical, such as {trace: delays.csv} (got"
            " none)",
        )


def _delay_line(experiment: Experiment) -> Iterator[Problem]:
    """Yield why the grid's own delay line cannot hold the delay of a continuous average.

    It holds the average at whole steps. The middle stages of rk3 and rk4 fall between two of them
    and are read off a cubic that reaches one step ahead, which after a delay of one step is not yet
    known.
    """
    delay, grid = experiment.network.delay, experiment.grid
    if experiment.wams.reporting != "continuous" or delay is None:
        return
    rate, least = grid.steps_per_second, 2 if grid.method in ("rk3", "rk4") else 1
    steps = delay * rate
    if _is_whole(steps) and (round(steps) == 0 or round(steps) >= least):
        return
    at_least = " and at least two" if least == 2 else ""
    yield Problem(
        (("network", "delay"), ("grid", "steps_per_second"), ("grid", "method")),
        f"network.delay must be 0 or a whole number{at_least} of integration steps of 1/{rate} s"
        f" with wams.reporting continuous and grid.method {grid.method}"
        f" (got {delay:g} s; {max(least, round(steps)) / rate:.9g} s would do)",
    )


def _repeated(path: Path, values: list[object]) -> Iterator[Problem]:
    for i, value in enumerate(values):
        if value in values[:i]:
            name = ".".join(map(str, path))
            yield Problem(((*path, i),), f"{name} names {value} twice")


def _is_whole(value: float) -> bool:
    return abs(value - round(value)) <= 1e-6 * max(1.0, abs(value) * 1e-6)


def _nearest_multiple(value: int, of: int) -> int:
    return max(1, round(value / of)) * of


def _nearest_divisor(value: int, of: int) -> int:
    divisors = [d for d in range(1, of + 1) if of % d == 0]
    return min(divisors, key=lambda divisor: abs(divisor - value))

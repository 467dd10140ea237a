"""What an experiment file may say, and what must hold between its parts."""

from collections.abc import Iterator
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StrictInt

from tieline.cosim.interfaces import FederationSettings
from tieline.experiment.problems import Path, Problem
from tieline.grid.settings import GridSettings, TripGenerator
from tieline.network.settings import NetworkSettings
from tieline.wams.settings import WamsSettings

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
    seed: StrictInt = Field(1, ge=0, lt=2**63, description="seed of every named random stream")
    grid: GridSettings = GridSettings()  # type: ignore[call-arg]
    wams: WamsSettings = WamsSettings()  # type: ignore[call-arg]
    network: NetworkSettings = NetworkSettings()  # type: ignore[call-arg]
    federation: FederationSettings = FederationSettings()  # type: ignore[call-arg]

    @property
    def rate_hz(self) -> int:
        """Meetings of the federates a second: one a reporting interval."""
        reporting = self.wams.reporting
        return CONTINUOUS_RATE_HZ if reporting == "continuous" else reporting

    @property
    def intervals(self) -> int:
        """Reporting intervals in the run."""
        return round(self.grid.duration * self.rate_hz)


FIXED: frozenset[str] = frozenset({"name", "question", "sweep"})
"""Keys that belong to the whole experiment: no sweep point can change them."""


def contradictions(experiment: Experiment) -> list[Problem]:
    """Return what does not fit together in an experiment whose single values are right."""
    return [*_timing(experiment), *_events(experiment), *_average(experiment), *_engine(experiment)]


def without_effect(experiment: Experiment) -> list[Problem]:
    """Return the network settings that are given but that the chosen engine does not read."""
    network = experiment.network
    readers = {
        "delay": ("constant",),
        "mean_delay": ("packet",),
        "loss": ("packet",),
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


def _events(experiment: Experiment) -> Iterator[Problem]:
    grid = experiment.grid
    seen: set[tuple[str, str]] = set()
    for i, event in enumerate(grid.events):
        at = ("grid", "events", i, "at")
        is_unit = isinstance(event, TripGenerator)
        kind = "trip_generator" if is_unit else "trip_branch"
        target: str = getattr(event, kind)
        if event.at >= grid.duration:
            yield Problem(
                (at, ("grid", "duration")),
                f"grid.events[{i}].at must lie before the end of the run at {grid.duration:g} s"
                f" (got {event.at:g} s)",
            )
        steps = event.at * grid.steps_per_second
        if not _is_whole(steps):
            yield Problem(
                (at, ("grid", "steps_per_second")),
                f"grid.events[{i}].at must fall on an integration step of"
                f" 1/{grid.steps_per_second} s (got {event.at:g} s;"
                f" {round(steps) / grid.steps_per_second:.6g} s would do)",
            )
        if (kind, target) in seen:
            yield Problem(
                (("grid", "events", i, kind),), f"grid.events[{i}]: '{target}' is tripped twice"
            )
        seen.add((kind, target))


def _average(experiment: Experiment) -> Iterator[Problem]:
    wams = experiment.wams
    units = experiment.grid.pss.units
    yield from _repeated(("grid", "pss", "units"), [] if units == "all" else list(units))
    if wams.sensors != "default":
        yield from _repeated(("wams", "sensors"), list(wams.sensors))
    if wams.weights == "equal":
        return
    if not any(wams.weights):
        yield Problem((("wams", "weights"),), "wams.weights must not all be 0")
    if wams.sensors != "default" and len(wams.weights) != len(wams.sensors):
        yield Problem(
            (("wams", "weights"), ("wams", "sensors")),
            f"wams.weights must have one weight for each of the {len(wams.sensors)} sensors"
            f" (got {len(wams.weights)})",
        )


def _engine(experiment: Experiment) -> Iterator[Problem]:
    network = experiment.network
    if experiment.wams.reporting == "continuous" and network.engine == "packet":
        yield Problem(
            (("wams", "reporting"), ("network", "engine")),
            "wams.reporting 'continuous' sends no frames, so it needs network.engine ideal or"
            " constant (got packet); give frames a second, such as 60, for packet",
        )
    if network.engine == "constant" and network.delay is None:
        yield Problem(
            (("network", "engine"), ("network", "delay")),
            "network.engine constant needs network.delay, such as 250 ms (got none)",
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

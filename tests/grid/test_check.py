"""What is refused before a process starts: experiments against the miniWECC."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.experiment.schema import Experiment, contradictions
from tieline.grid.case import Case
from tieline.grid.check import check
from tieline.grid.events import plan_events
from tieline.grid.settings import GridSettings
from tieline.wams.settings import WamsSettings


def findings_of(
    case: Case, grid: dict[str, Any] | None = None, wams: dict[str, Any] | None = None
) -> tuple[str, ...]:
    """Return what `check` finds."""
    with pytest.raises(InputError) as caught:
        check(case, GridSettings(**(grid or {})), WamsSettings(**(wams or {})))
    return caught.value.findings


def events(*given: dict[str, Any]) -> dict[str, Any]:
    return {"events": list(given)}


def trip(unit: str, at: float = 1.0) -> dict[str, Any]:
    return {"at": at, "trip_generator": unit}


def opening(branch: str, at: float = 1.0) -> dict[str, Any]:
    return {"at": at, "trip_branch": branch}


def test_an_experiment_that_can_run_gives_its_sites(miniwecc: Case) -> None:
    """PMUs and controllers stand where case and experiment say, in that order."""
    grid = GridSettings(pss={"units": ["G3", "G1"]})
    sites = check(miniwecc, grid, WamsSettings(sensors=[61, 2]))
    assert sites.sensors == (61, 2)
    assert sites.controllers == (("G1", 1), ("G3", 5))
    assert len(check(miniwecc, GridSettings(), WamsSettings()).controllers) == 34


@pytest.mark.parametrize(
    ("grid", "wams", "words"),
    [
        (
            events(trip("G62")),
            {},
            ["grid.events[0].trip_generator: no unit 'G62'", "did you mean 'G"],
        ),
        (
            {"pss": {"units": ["G1", "g2"]}},
            {},
            ["grid.pss.units: no unit 'g2'"],
        ),
        (
            {"pss": {"model": "none", "units": ["G222"]}},
            {},
            ["grid.pss.units: no unit 'G222'; did you mean 'G22'?"],
        ),
        (
            events(opening("60-71")),
            {},
            ["grid.events[0].trip_branch: no branch '60-71'; did you mean '60-61'?"],
        ),
        (
            events(opening("60-61#2")),
            {},
            ["grid.events[0].trip_branch: no branch '60-61#2'", "did you mean '60-61'?"],
        ),
        (events(opening("G26")), {}, ["grid.events[0].trip_branch: no branch 'G26'"]),
        (
            events(trip("G26", 1.001)),
            {},
            ["grid.events[0].at: must fall on a step of 1/240 s", "1.001 s", "the nearest is 1 s"],
        ),
        (
            events(trip("G26", 41.0)),
            {},
            ["grid.events[0].at: must be before the end at 41 s (got 41 s)"],
        ),
        (
            events(opening("7-10"), opening("10-7", 2.0)),
            {},
            ["grid.events[1]: branch 7-10 is open already"],
        ),
        (
            events(opening("60-61", 2.0), trip("G26", 1.0)),
            {},
            ["grid.events[0]: branch 60-61 is open already"],
        ),
        (
            {"pss": {"average": "rotors"}},
            {},
            ["grid.pss.average: rotors is no measurement", "continuous (got 60)"],
        ),
        ({}, {"sensors": [2, 1200]}, ["wams.sensors: no bus 1200", "did you mean '120'?"]),
    ],
)
def test_what_the_case_does_not_have_or_cannot_do_is_named(
    miniwecc: Case, grid: dict[str, Any], wams: dict[str, Any], words: list[str]
) -> None:
    """An hour of simulation must not end with a name that a second could have refused."""
    findings = findings_of(miniwecc, grid, wams)
    assert len(findings) == 1, findings
    assert all(word in findings[0] for word in words), findings


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("7-10", "7-10"),
        ("10-7", "7-10"),
        ("7-10#1", "7-10"),
        ("10 - 7", "7-10"),
        ("6-79#2", "6-79#2"),
        ("79-6#2", "6-79#2"),
    ],
)
def test_a_branch_is_named_from_either_end(miniwecc: Case, given: str, meant: str) -> None:
    """Nobody remembers which end a table lists first; the circuit must still be the right one."""
    assert {"7-10", "6-79", "6-79#2"} <= set(miniwecc.branches.name)
    (event,) = plan_events(miniwecc, GridSettings(**events(opening(given))))
    opened = event.stages[0].change.opens
    assert [miniwecc.branches.name[row] for row in opened] == [meant]


def dead_end(case: Case) -> tuple[str, int]:
    """Return a branch whose opening cuts off one bus without a unit, and that bus."""
    row = case.branches.name.index("8-7")
    return case.branches.name[row], 8


def test_a_unit_that_shares_its_bus_cannot_be_tripped_by_a_branch(miniwecc: Case) -> None:
    """Opening its branches would take its neighbour, or a load, out as well."""
    unit_bus = miniwecc.unit_bus.copy()
    unit_bus[miniwecc.units.index("G27")] = unit_bus[miniwecc.units.index("G26")]
    shared = replace(miniwecc, unit_bus=unit_bus)
    with pytest.raises(InputError, match=r"events\[0\].trip_generator: 'G26' shares bus 60"):
        plan_events(shared, GridSettings(**events(trip("G26"))))


def test_a_stabiliser_on_a_unit_without_exciter_is_refused(miniwecc: Case) -> None:
    """Its output would act on nothing, and the run would look like one with a stabiliser."""
    devices = {
        role: tuple(d for d in of_role if d.unit != "G7" or role not in ("exciter", "pss"))
        for role, of_role in miniwecc.devices.items()
    }
    findings = findings_of(replace(miniwecc, devices=devices), {"pss": {"units": ["G7", "G8"]}})
    assert findings == ("grid.pss.units: unit 'G7' has no exciter, so a PSS cannot act on it",)


def test_a_power_flow_that_diverges_is_refused(miniwecc: Case) -> None:
    """There is no operating point to start from."""
    heavy = replace(miniwecc, buses=replace(miniwecc.buses, p_load=miniwecc.buses.p_load * 3.0))
    (finding,) = findings_of(heavy)
    assert finding.startswith("the power flow of case 'miniwecc' diverged")


def test_an_operating_point_beyond_a_limit_is_refused_with_the_unit(miniwecc: Case) -> None:
    """A unit that starts on its limit does not stay where the power flow put it."""
    devices = dict(miniwecc.devices)
    devices["exciter"] = tuple(
        replace(d, values={**d.values, "Efdmax": 0.5}) if d.unit == "G7" else d
        for d in devices["exciter"]
    )
    (finding,) = findings_of(replace(miniwecc, devices=devices))
    assert finding.startswith("st3_potential of 'G7': ")
    assert "0.5" in finding


def test_a_network_in_parts_is_refused_with_the_buses_that_hang_on_nothing(miniwecc: Case) -> None:
    """A power flow with a singular Jacobian would only say that it diverged."""
    branch, bus = dead_end(miniwecc)
    keep = np.arange(len(miniwecc.branches.name)) != miniwecc.branches.name.index(branch)
    branches = {
        key: tuple(np.array(value)[keep]) if isinstance(value, tuple) else value[keep]
        for key, value in vars(miniwecc.branches).items()
    }
    parted = replace(miniwecc, branches=type(miniwecc.branches)(**branches))
    (finding,) = findings_of(parted)
    assert finding.startswith(f"branch.csv: buses [{bus}] of case 'miniwecc' are not connected to")


def test_everything_is_reported_together(miniwecc: Case) -> None:
    """Six mistakes must not take six attempts."""
    grid = {
        "pss": {"units": ["G99"], "average": "rotors"},
        **events(trip("G98"), opening("1-99"), trip("G26", 50.0)),
    }
    heavy = replace(miniwecc, buses=replace(miniwecc.buses, p_load=miniwecc.buses.p_load * 3.0))
    text = "\n".join(findings_of(heavy, grid, {"sensors": [999]}))
    for word in ("G99", "rotors", "G98", "1-99", "before the end", "diverged", "no bus 999"):
        assert word in text, word


def delayed(delay: str, method: str = "rk4", rate: int = 240) -> list[str]:
    """Return what contradicts a delay of the continuously formed average."""
    experiment = Experiment.model_validate(
        {
            "name": "late",
            "question": "?",
            "grid": {"method": method, "steps_per_second": rate},
            "wams": {"reporting": "continuous"},
            "network": {"engine": "constant", "delay": delay},
        }
    )
    return [problem.text for problem in contradictions(experiment)]


@pytest.mark.parametrize(
    ("delay", "method", "rate"),
    [
        ("0", "rk4", 240),
        ("1.25 s", "rk4", 240),
        ("0.008333333333 s", "rk4", 240),
        ("0.0041666667 s", "heun", 240),
        ("0.1 s", "heun", 480),
    ],
)
def test_a_delay_of_whole_steps_is_accepted(delay: str, method: str, rate: int) -> None:
    """A multiple of 1/240 s cannot be written exactly in decimals: nine digits must do."""
    assert delayed(delay, method, rate) == []


@pytest.mark.parametrize(
    ("delay", "method", "words"),
    [
        ("0.101 s", "heun", ["0 or a whole number of", "0.101 s", "0.1 s would do"]),
        ("0.101 s", "rk4", ["whole number and at least two of", "0.1 s would do"]),
        ("1 ms", "heun", ["0.00416666667 s would do"]),
        ("0.0041666667 s", "rk4", ["at least two", "0.00833333333 s would do"]),
        ("0.0041666667 s", "rk3", ["at least two", "0.00833333333 s would do"]),
    ],
)
def test_a_delay_that_the_delay_line_cannot_hold_is_refused_with_the_experiment(
    delay: str, method: str, words: list[str]
) -> None:
    """Found inside the federate, it would come after every process has started."""
    (text,) = delayed(delay, method)
    assert text.startswith("network.delay must be 0 or a whole number")
    assert all(word in text for word in words), text


def test_a_delay_between_steps_is_no_matter_for_frames() -> None:
    """Frames arrive when they arrive; only the grid's own delay line counts in steps."""
    experiment = Experiment.model_validate(
        {
            "name": "late",
            "question": "?",
            "network": {"engine": "constant", "delay": "0.101 s"},
        }
    )
    assert contradictions(experiment) == []

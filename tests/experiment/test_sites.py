"""Experiments against the shipped case and network, before anything starts."""

from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare

# (settings of the smoke experiment, words of each finding)
REFUSALS = [
    (["grid.events.0.trip_generator=G62"], ["no unit 'G62'"]),
    (["grid.events=[{at: 1 s, trip_branch: 60-62}]"], ["no branch '60-62'; did you mean '60-61'"]),
    (["grid.pss.units=[G1, G99]"], ["no unit 'G99'"]),
    (["wams.sensors=[2, 611]"], ["no bus 611 in case 'miniwecc'"]),
    (["wams.weights=[1, 2]"], ["one weight for each of the 30 sensors (got 2)"]),
    (["wams.weights=H", "wams.sensors=[2, 8]"], ["bus 8 has none"]),
    (
        [
            "wams.weights=[1, 2]",
            "grid.pss.average=rotors",
            "wams.reporting=continuous",
            "network.engine=ideal",
        ],
        ["one weight for each of the 34 units"],
    ),
    (["network.mean_delay=1 ms"], ["network.mean_delay must be at least"]),
    (
        ["network.mean_delay=1 ms", "wams.sensors=[2, 611]", "grid.pss.units=[G1, G99]"],
        ["network.mean_delay must be at least", "no bus 611", "no unit 'G99'"],
    ),
]


@pytest.mark.parametrize(("settings", "expected"), REFUSALS, ids=lambda value: str(value)[:40])
def test_what_the_case_lacks_is_refused_where_it_was_asked_for(
    settings: list[str], expected: list[str]
) -> None:
    """Otherwise the processes would start, and one of them would die of a user's mistake."""
    with pytest.raises(InputError) as caught:
        prepare(load_experiment("g26_trip_smoke", settings))
    findings = caught.value.findings
    assert len(findings) == len(expected), findings
    for words in expected:
        (finding,) = [finding for finding in findings if words in finding]
        assert finding.startswith("--set "), finding


def test_every_point_of_the_shipped_sweep_can_run() -> None:
    """Otherwise the first command of a newcomer would be refused."""
    runs = prepare(load_experiment("g26_trip")).runs
    assert {len(run.run["sources"]) for run in runs} == {30}
    assert {len(run.run["destinations"]) for run in runs} == {34}
    assert [Path(run.run["network"]["topology"] or "none").name for run in runs] == [
        "none",
        *["network.yaml"] * 5,
    ]
    assert all(run.run["tie_mode"]["units"] == ["G34"] for run in runs)

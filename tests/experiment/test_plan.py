"""What each run is told."""

import json
from pathlib import Path
from typing import Any

import pytest

from synthetic_result import CONSTANT, EXPERIMENT, SITES, SWEEP, known_sites, plan_of
from tieline.errors import InputError
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import canonical_json, config_hash, prepare
from tieline.experiment.schema import Experiment
from tieline.experiment.sites import Sites
from tieline.resources import shipped


def test_the_run_file_holds_all_that_a_federate_needs(tmp_path: Path) -> None:
    """Otherwise a federate would have to read the experiment again and could read it otherwise."""
    (planned,) = plan_of(tmp_path).runs
    run = json.loads(json.dumps(planned.run))
    assert run["clock"] == {"rate_hz": 60, "intervals": 2460, "lead": 0}
    assert run["sources"] == [
        {"name": "pmu00", "bus": 2},
        {"name": "pmu01", "bus": 61},
        {"name": "pmu02", "bus": 119},
    ]
    assert run["destinations"][1] == {"name": "ctl01", "unit": "G34", "bus": 118}
    assert run["grid"]["events"] == [{"at": 1.0, "when": None, "trip_generator": "G26"}]
    assert run["network"]["topology"] is None
    assert run["tie_mode"] == SITES.tie_mode
    assert run["frequency_hz"] == 60.0
    assert Path(run["case"], "case.yaml").is_file()


def test_names_are_padded_so_that_they_sort_as_they_count(tmp_path: Path) -> None:
    """Otherwise HELICS would hand over the frames of one instant in another order."""
    names = [source["name"] for source in Sites(tuple(range(101)), ()).sources()]
    assert names == sorted(names)
    assert names[0] == "pmu000"


def test_a_topology_is_found_beside_the_experiment(tmp_path: Path) -> None:
    """Otherwise an experiment could not be sent to a colleague with its network."""
    (tmp_path / "net.yaml").write_text("nodes: []\n")
    (tmp_path / "tiny.yaml").write_text(EXPERIMENT)
    study = load_experiment(str(tmp_path / "tiny.yaml"), ["network.topology=net.yaml"])
    (planned,) = prepare(study, known_sites).runs
    assert planned.run["network"]["topology"] == str((tmp_path / "net.yaml").resolve())
    assert len(planned.inputs["topology"]) == 64


def test_a_topology_of_the_case_is_found_by_its_name(tmp_path: Path) -> None:
    """Otherwise an installed tieline's second network could be used by nobody."""
    (tmp_path / "tiny.yaml").write_text(EXPERIMENT)
    study = load_experiment(str(tmp_path / "tiny.yaml"), ["network.topology=wan"])
    (planned,) = prepare(study, known_sites).runs
    assert planned.run["network"]["topology"] == str(shipped("cases") / "miniwecc" / "wan.yaml")
    study = load_experiment(str(tmp_path / "tiny.yaml"), ["network.topology=wam"])
    with pytest.raises(InputError, match=r"the case has: case, wan; did you mean 'wan'"):
        prepare(study, known_sites)


def test_a_missing_topology_or_case_is_located(tmp_path: Path) -> None:
    """Otherwise the user would be told of a missing file, but not who asked for it."""
    (tmp_path / "tiny.yaml").write_text(EXPERIMENT + "network: {topology: nett.yaml}\n")
    with pytest.raises(InputError, match=r"tiny.yaml:8: network.topology 'nett.yaml' is missing"):
        prepare(load_experiment(str(tmp_path / "tiny.yaml")), known_sites)
    (tmp_path / "tiny.yaml").write_text(EXPERIMENT.replace("case: miniwecc", "case: minwecc"))
    with pytest.raises(InputError, match=r"tiny.yaml:4: case: .*minwecc.*did you mean .miniwecc"):
        prepare(load_experiment(str(tmp_path / "tiny.yaml"), CONSTANT), known_sites)


def test_a_case_of_ones_own_is_found_beside_the_experiment(tmp_path: Path) -> None:
    """Otherwise a case would have to be installed before it can be used."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "case.yaml").write_text("name: mine\n")
    plan = plan_of(tmp_path, EXPERIMENT.replace("case: miniwecc", "case: mine"))
    assert plan.runs[0].run["case"] == str((tmp_path / "mine").resolve())


def test_findings_of_the_case_get_the_line_of_the_setting(tmp_path: Path) -> None:
    """Otherwise 'no unit G99' would not say which of the files asks for it."""

    def survey(*_: object) -> Sites:
        raise InputError(
            ["grid.events[0].trip_generator: no unit 'G26'", "bus.csv:3: 'x' must be a number"]
        )

    (tmp_path / "tiny.yaml").write_text(EXPERIMENT)
    with pytest.raises(InputError) as caught:
        prepare(load_experiment(str(tmp_path / "tiny.yaml"), CONSTANT), survey)
    first, second = caught.value.findings
    assert first.endswith("tiny.yaml:7: grid.events[0].trip_generator: no unit 'G26'")
    assert second == "bus.csv:3: 'x' must be a number"


def test_points_that_look_alike_to_the_case_are_surveyed_once(tmp_path: Path) -> None:
    """Otherwise a sweep over seeds would solve the same power flow again and again."""
    calls: list[Any] = []

    def survey(*given: Any) -> Sites:
        calls.append(given)
        return SITES

    text = EXPERIMENT + "sweep: [{label: a, seed: 1}, {label: b, seed: 2}]\n"
    (tmp_path / "tiny.yaml").write_text(text + "network: {engine: ideal}\n")
    assert len(prepare(load_experiment(str(tmp_path / "tiny.yaml")), survey).runs) == 2
    assert len(calls) == 1


def test_equal_settings_have_equal_hashes_and_others_not(tmp_path: Path) -> None:
    """Otherwise one could not tell which runs belong to the same experiment."""
    base = {"name": "a", "question": "b", "grid": {"duration": "1 s"}}
    same = {"question": "b", "name": "a", "grid": {"duration": 1.0}, "seed": 1}
    hashes = [config_hash(Experiment.model_validate(data)) for data in (base, same)]
    assert hashes[0] == hashes[1]
    assert config_hash(Experiment.model_validate(base | {"seed": 2})) != hashes[0]
    assert canonical_json({"b": 1, "a": [1.5]}) == '{"a":[1.5],"b":1}'


def test_every_point_has_a_name_and_hash_of_its_own(tmp_path: Path) -> None:
    """Otherwise logs of two points could not be told apart."""
    runs = plan_of(tmp_path, EXPERIMENT + SWEEP).runs
    assert len({run.run["run_id"] for run in runs}) == 2
    assert len({run.run["config_hash"] for run in runs}) == 2

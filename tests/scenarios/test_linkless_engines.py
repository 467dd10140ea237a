"""Whole runs with the engines that have no links, started the way the command line does."""

from pathlib import Path

import pytest

from scenarios.study import run
from tieline.experiment.load import find_experiment
from tieline.experiment.results import Run

SHORT = ("grid.duration=1 s", "grid.events=[{at: 0.2 s, trip_generator: G26}]", "seed=7")
TRACE = ("network.engine=empirical", "network.empirical.draw=in_turn", "network.loss=0.01")


def hashes(result: Run) -> dict[str, str]:
    return dict(result.manifest["tables"])


def core(name: str) -> tuple[str, str]:
    return (f"federation.core={name}", "federation.hang_timeout=60 s")


@pytest.mark.helics
def test_measured_delays_drive_a_whole_run_alike_over_every_core(tmp_path: Path) -> None:
    """Otherwise a delay trace from the field could not be studied, or not be repeated."""
    trace = tmp_path / "delays.csv"
    trace.write_text("delay_s\n0.08\n0.12\n0.3\n0.09\n")
    settings = (*SHORT, *TRACE, f"network.empirical.trace={trace}")
    results = [run("g26_trip_smoke", tmp_path / c, *settings, *core(c)) for c in ("local", "zmq")]
    assert hashes(results[0]) == hashes(results[1])
    flows = results[0].table("flows")
    assert flows["delay_min_s"].min() == 0.08
    assert flows["dropped_loss"].sum() > 0
    assert (flows["sent"] == flows["delivered"] + flows["dropped_loss"] + flows["in_flight"]).all()
    assert "trace" in results[0].manifest["inputs"]


def test_a_trace_is_found_beside_its_experiment(tmp_path: Path) -> None:
    """Otherwise an experiment and its delays could not be moved together."""
    text = find_experiment("g26_trip_smoke").read_text()
    network = "network: {engine: empirical, empirical: {trace: delays.csv}}\n"
    experiment = tmp_path / "own.yaml"
    experiment.write_text(text.replace("name: g26_trip_smoke", "name: own") + network)
    (tmp_path / "delays.csv").write_text("delay_s\n0.1\n")
    result = run(str(experiment), tmp_path / "r", *SHORT, *core("local"))
    assert set(result.table("flows")["delay_max_s"]) == {0.1}


@pytest.fixture(scope="module")
def constant(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a run of the constant engine."""
    settings = (*SHORT, "network.delay=50 ms", "network.engine=constant", *core("local"))
    return run("g26_trip_smoke", tmp_path_factory.mktemp("constant") / "c", *settings)


@pytest.mark.helics
@pytest.mark.parametrize("name", ["local", "inproc", "zmq"])
def test_helics_filters_give_the_run_of_the_constant_engine(
    name: str, constant: Run, tmp_path: Path
) -> None:
    """Otherwise what is compared with HELICS's filters would be compared with something else."""
    settings = (*SHORT, "network.delay=50 ms", "network.engine=helics-filters", *core(name))
    filtered = run("g26_trip_smoke", tmp_path / "f", *settings)
    assert hashes(filtered) == hashes(constant)


@pytest.mark.helics
def test_helics_filters_with_random_drop_run_to_the_end(tmp_path: Path) -> None:
    """Otherwise the loss that HELICS offers could not be compared with a network's."""
    settings = ("network.engine=helics-filters", "network.delay=50 ms", "network.loss=0.05")
    result = run("g26_trip_smoke", tmp_path / "r", *SHORT, *settings, *core("zmq"))
    packets = result.summary()["packets"]
    assert 0.03 < packets["loss"] < 0.07
    ended = packets["delivered"] + packets["dropped_loss"]
    assert packets["sent"] == ended + packets["in_flight"]

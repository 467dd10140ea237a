"""The example of a stabiliser outside the package, from its file to its result."""

import hashlib
import importlib.util
from pathlib import Path

import numpy as np
import pytest

from conformance.test_linearisation import transfer
from scenarios.study import run
from tieline.errors import InputError
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare

FOLDER = Path(__file__).parents[2] / "examples" / "my_pss"
EXPERIMENT = str(FOLDER / "experiment.yaml")
SHORT = ("grid.duration=2 s", "federation.core=local", "network.engine=ideal")


def test_the_example_runs_and_its_stabiliser_acts(tmp_path: Path) -> None:
    """An example that does not run is worse than none."""
    result = run(EXPERIMENT, tmp_path / "out", *SHORT)
    grid = result.table("grid")
    assert np.abs(grid.loc[grid["t_s"] < 1.0, "vs_pu.G1"]).max() < 1e-10
    assert 1e-4 < np.abs(grid["vs_pu.G1"]).max() <= 0.1


def test_the_run_knows_the_files_content_and_place() -> None:
    """Otherwise a result could not be traced to the stabiliser that made it."""
    study = load_experiment(EXPERIMENT)
    (planned,) = prepare(study).runs
    own = FOLDER / "my_pss.py"
    assert planned.inputs["pss"] == hashlib.sha256(own.read_bytes()).hexdigest()
    assert planned.run["grid"]["pss"]["file"] == str(own.resolve())
    assert study.points[0].experiment.grid.pss.file == "my_pss.py"


def test_the_examples_equations_are_its_declared_transfer_function() -> None:
    """The example shows how to check one's own model; so it must pass itself."""
    spec = importlib.util.spec_from_file_location("example_pss", FOLDER / "my_pss.py")
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    model = module.SwingPSS
    model.example = {"K": 9.0, "Tw": 10.0, "T1": 0.3, "T2": 0.03, "limit": 0.1}
    s = 2j * np.pi * 0.4
    for (name, got), declared in model.transfer(s, model.example, {}).items():
        assert transfer(model, name, got, s) == pytest.approx(declared, rel=1e-6)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["grid.pss.file=my_ps.py"], "grid.pss.file 'my_ps.py' is missing"),
        (["grid.pss.model=swingpss"], "no model 'swingpss'; did you mean 'swing_pss'?"),
        (["grid.pss.tuning={G2: {KK: 1}}"], "swing_pss has no parameter 'KK'; did you mean 'K'?"),
        (["grid.pss.parameters.Tw=0"], "swing_pss.Tw of 'G1' must be > 0 s (got 0)"),
        (["grid.pss.beta1=1"], "swing_pss has no parameter 'beta1'"),
    ],
)
def test_a_slip_in_its_settings_is_refused_before_anything_starts(
    settings: list[str], words: str
) -> None:
    """A model from outside gets the same checks as a shipped one."""
    with pytest.raises(InputError) as caught:
        prepare(load_experiment(EXPERIMENT, settings))
    finding = next(finding for finding in caught.value.findings if words in finding)
    assert finding.startswith("--set grid.pss.")


def test_without_its_file_the_model_is_unknown() -> None:
    """The file of one experiment must not leak into the next one of the same process."""
    prepare(load_experiment(EXPERIMENT))
    with pytest.raises(InputError, match="grid.pss.model must be one of none, standard"):
        load_experiment("g26_trip_smoke", ["grid.pss.model=swing_pss"])

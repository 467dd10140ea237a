"""The example of a stabiliser outside the package, from its file to its result."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from grid.stabiliser_runs import gain, respond, swing
from scenarios.study import run
from tieline.errors import InputError
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega
from tieline.grid.models.registry import models, use_file

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


def test_the_example_is_the_generalised_stabiliser_without_beta2() -> None:
    """The example shows how to write equations; so they have to be right."""
    use_file("pss", FOLDER / "my_pss.py")
    own = models("pss")["swing_pss"]
    values = {"K": 9.0, "Tw": 10.0, "T1": 0.3, "T2": 0.03, "limit": 0.1}
    shipped = {**values, **dict.fromkeys(("T3", "T4", "T5", "T6"), 0.0)}
    shipped |= {"vsmax": 0.1, "vsmin": -0.1, "beta1": 1.0, "beta2": 0.0}
    np.testing.assert_array_equal(
        respond(own, values, swing, 2.0), respond(GeneralizedDeltaOmega, shipped, swing, 2.0)
    )
    for name in ("omega", "wbar"):
        assert gain(own, values, name, 0.4) == gain(GeneralizedDeltaOmega, shipped, name, 0.4)
    use_file("pss", None)


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
    with pytest.raises(InputError, match=r"grid\.pss\.model must be one of none, standard"):
        load_experiment("g26_trip_smoke", ["grid.pss.model=swing_pss"])

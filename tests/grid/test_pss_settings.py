"""Which stabiliser each unit gets, with which numbers, and what is refused."""

from dataclasses import replace

import pytest
from pydantic import ValidationError

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.models.base import Model
from tieline.grid.models.pss.delta_omega import DeltaOmega
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega
from tieline.grid.models.pss.pss1a import PSS1A
from tieline.grid.models.registry import models
from tieline.grid.pss_settings import PssSettings
from tieline.grid.stabilisers import with_pss


def fitted(case: Case, **settings: object) -> dict[str, tuple[type[Model], dict[str, float]]]:
    """Return model and values of each stabiliser in service, by unit."""
    devices = with_pss(case, PssSettings(**settings)).devices["pss"]
    return {device.unit: (device.model, dict(device.values)) for device in devices}


def refusals(case: Case, **settings: object) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        with_pss(case, PssSettings(**settings))
    return caught.value.findings


@pytest.fixture
def mixed(miniwecc: Case) -> Case:
    """The miniWECC with a PSS1A at G2 in place of its own."""
    devices = [
        replace(d, model=PSS1A, values=PSS1A.example) if d.unit == "G2" else d
        for d in miniwecc.devices["pss"]
    ]
    return replace(miniwecc, devices={**miniwecc.devices, "pss": tuple(devices)})


@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("standard", DeltaOmega),
        ("generalized", GeneralizedDeltaOmega),
        ("delta_omega", DeltaOmega),
        ("generalized_delta_omega", GeneralizedDeltaOmega),
    ],
)
def test_a_model_goes_by_its_key_or_its_short_name(
    miniwecc: Case, name: str, model: type[Model]
) -> None:
    """Experiments written before the others existed stay what they were."""
    found = fitted(miniwecc, model=name)
    assert {device[0] for device in found.values()} == {model}
    assert len(found) == 34


@pytest.mark.parametrize("name", sorted(models("pss")))
def test_every_registered_model_can_be_asked_for(miniwecc: Case, name: str) -> None:
    """A model that no experiment can name is of no use."""
    example = dict(models("pss")[name].example)
    found = fitted(miniwecc, model=name, parameters=example)
    assert found["G1"] == (models("pss")[name], example)


def test_case_leaves_each_unit_its_own(mixed: Case) -> None:
    """A utility's data give every unit what it has in the field."""
    found = fitted(mixed, model="case")
    assert found["G2"] == (PSS1A, dict(PSS1A.example))
    assert found["G1"][0] is DeltaOmega
    assert found["G1"][1] == dict(mixed.devices["pss"][0].values)


def test_none_leaves_no_stabiliser(miniwecc: Case) -> None:
    """The paper's unstable case."""
    assert fitted(miniwecc, model="none") == {}


def test_the_nearer_source_of_a_value_wins(miniwecc: Case) -> None:
    """Table, then the experiment's gain and betas, its parameters, and the unit's own tuning."""
    found = fitted(
        miniwecc,
        gain=9.0,
        beta1=0.7,
        parameters={"T1": 0.3, "beta1": 0.6},
        tuning={"G3": {"K": 5.0, "T1": 0.2, "beta1": 0.5}},
    )
    table = miniwecc.device("pss", "G1").values
    values = found["G1"][1]
    assert (values["K"], values["T1"], values["beta1"], values["beta2"]) == (9.0, 0.3, 0.6, 1.0)
    assert values["T2"] == table["T2"]
    assert values["T5"] == values["T6"] == 0.0
    tuned = found["G3"][1]
    assert (tuned["K"], tuned["T1"], tuned["beta1"]) == (5.0, 0.2, 0.5)


def test_a_tables_own_betas_hold_unless_the_experiment_gives_others(miniwecc: Case) -> None:
    """A default of the experiment that overrode a table would be a setting nobody made."""
    tables = [
        replace(d, model=GeneralizedDeltaOmega, values={**GeneralizedDeltaOmega.example})
        for d in miniwecc.devices["pss"]
    ]
    case = replace(miniwecc, devices={**miniwecc.devices, "pss": tuple(tables)})
    assert fitted(case, model="case")["G1"][1]["beta2"] == 0.5
    assert fitted(case, model="case", beta2=0.9)["G1"][1]["beta2"] == 0.9


def test_parameters_reach_those_models_that_have_them(mixed: Case) -> None:
    """With models of several kinds one name may mean some of them only."""
    found = fitted(mixed, model="case", parameters={"T5": 3.0, "T1": 0.4})
    assert found["G2"][1]["T5"] == 3.0
    assert found["G1"][1]["T1"] == found["G2"][1]["T1"] == 0.4
    assert "T5" not in found["G1"][1]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (
            {"model": "pss1a"},
            "pss1a of 'G1' and 33 more needs KS, T5, VSTmax, VSTmin, which miniwecc/pss.csv",
        ),
        ({"parameters": {"TW": 5.0}}, "has no parameter 'TW'; did you mean 'Tw'?"),
        ({"parameters": {"T2": 0.0}}, "generalized_delta_omega.T2 of 'G1' must be > 0 s (got 0)"),
        ({"parameters": {"T5": 0.2}}, "'G1' needs T6 > 0 s beside T5 = 0.2 s"),
        ({"tuning": {"G99": {"K": 1.0}}}, "grid.pss.tuning: no unit 'G99'"),
        ({"tuning": {"G3": {"KK": 1.0}}}, "grid.pss.tuning.G3: generalized_delta_omega has no"),
        ({"tuning": {"G3": {"beta1": 1.5}}}, "beta1 of 'G3' must be >= 0 and <= 1 (got 1.5)"),
        ({"tuning": {"G3": {"K": 1.0}}, "units": ["G1"]}, "'G3' is not among grid.pss.units"),
        ({"model": "delta_omega", "beta1": 0.5}, "grid.pss.beta1: delta_omega has no parameter"),
        (
            {"model": "pss1a", "gain": 5.0, "parameters": dict(PSS1A.example)},
            "grid.pss.gain: pss1a has no parameter 'K'; did you mean 'KS'?",
        ),
    ],
)
def test_a_slip_is_named_with_what_would_be_right(
    miniwecc: Case, settings: dict[str, object], words: str
) -> None:
    """One sentence says where, what was given and what is allowed."""
    findings = refusals(miniwecc, **settings)
    assert any(words in finding for finding in findings), findings
    assert all(finding.startswith("grid.pss") for finding in findings)


def test_what_all_units_lack_is_said_once(miniwecc: Case) -> None:
    """Thirty-four sentences of ninety names each would hide the one that matters."""
    assert len(refusals(miniwecc, model="pss4c")) == 1


def test_an_unknown_model_is_refused_at_once_with_the_nearest() -> None:
    """Before the case is read; a file of one's own may bring any name."""
    with pytest.raises(ValidationError, match=r"one of none, standard.*did you mean 'pss2c'"):
        PssSettings(model="pss2b")
    assert PssSettings(file="mine.py", model="pss2b").model == "pss2b"


def test_a_file_that_does_not_bring_the_model_is_no_excuse(miniwecc: Case) -> None:
    """The check that a file postpones must not be lost."""
    (finding,) = refusals(miniwecc, file="mine.py", model="pss2b")
    assert finding.startswith("grid.pss.model: no model 'pss2b'; did you mean 'pss2c'?")

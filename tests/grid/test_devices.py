"""The experiment's stabilisers on the case's units."""

from dataclasses import replace

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.devices import groups, with_pss
from tieline.grid.models.exciters.st3_potential import ST3Potential
from tieline.grid.models.pss.delta_omega import DeltaOmega
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega
from tieline.grid.settings import PssSettings


def test_the_generalised_stabiliser_takes_the_tables_constants_and_the_experiments_tuning(
    miniwecc: Case,
) -> None:
    """A lead-lag that changed with the tuning would make two tunings incomparable."""
    fitted = with_pss(miniwecc, PssSettings(gain=9.0, beta1=0.25, beta2=0.75)).devices["pss"]
    for device, table in zip(fitted, miniwecc.devices["pss"], strict=True):
        assert device.model is GeneralizedDeltaOmega
        expected = {**table.values, "K": 9.0, "beta1": 0.25, "beta2": 0.75}
        defaults = {p.symbol: p.default for p in GeneralizedDeltaOmega.parameters}
        assert dict(device.values) == {**defaults, **expected}


def test_without_a_gain_the_case_keeps_its_own(miniwecc: Case) -> None:
    """The miniWECC's stabilisers have K = 4."""
    fitted = with_pss(miniwecc, PssSettings()).devices["pss"]
    assert {device.values["K"] for device in fitted} == {4.0}


def test_a_gain_of_zero_is_a_gain(miniwecc: Case) -> None:
    """Zero taken for 'not given' would leave every stabiliser at full gain."""
    fitted = with_pss(miniwecc, PssSettings(gain=0.0)).devices["pss"]
    assert {device.values["K"] for device in fitted} == {0.0}


def test_the_standard_stabiliser_knows_no_weights(miniwecc: Case) -> None:
    """It is the model of the table; beta1 and beta2 mean nothing to it."""
    fitted = with_pss(miniwecc, PssSettings(model="standard", gain=9.0)).devices["pss"]
    assert {device.model for device in fitted} == {DeltaOmega}
    assert dict(fitted[0].values) == {**miniwecc.devices["pss"][0].values, "K": 9.0}


def test_none_leaves_no_stabiliser_and_every_other_device(miniwecc: Case) -> None:
    """The reference without control is the same system otherwise."""
    bare = with_pss(miniwecc, PssSettings(model="none"))
    assert bare.devices["pss"] == ()
    assert bare.devices["exciter"] == miniwecc.devices["exciter"]


def test_named_units_alone_are_fitted_in_the_order_of_the_table(miniwecc: Case) -> None:
    """Controllers are numbered by this order, in every federate."""
    fitted = with_pss(miniwecc, PssSettings(units=["G9", "G2"])).devices["pss"]
    assert [device.unit for device in fitted] == ["G2", "G9"]
    assert with_pss(miniwecc, PssSettings(units=[])).devices["pss"] == ()


def test_a_unit_without_a_row_in_the_table_cannot_be_fitted_by_name(miniwecc: Case) -> None:
    """There is no time constant to give it."""
    table = tuple(device for device in miniwecc.devices["pss"] if device.unit != "G5")
    case = replace(miniwecc, devices={**miniwecc.devices, "pss": table})
    assert len(with_pss(case, PssSettings()).devices["pss"]) == 33
    with pytest.raises(InputError, match=r"unit 'G5' has no row in miniwecc/pss.csv"):
        with_pss(case, PssSettings(units=["G5"]))


def test_constants_that_the_table_does_not_give_are_named(
    miniwecc: Case,
) -> None:
    """A table of another model has other constants."""
    row = miniwecc.devices["pss"][0]
    bare = replace(row, values={k: v for k, v in row.values.items() if k not in ("Tw", "T4")})
    case = replace(miniwecc, devices={**miniwecc.devices, "pss": (bare,)})
    with pytest.raises(InputError, match=r"of 'G1' needs Tw, T4, which miniwecc/pss.csv"):
        with_pss(case, PssSettings())


def test_a_gain_outside_the_models_bound_is_refused_for_each_unit(miniwecc: Case) -> None:
    """The settings' own bound and the model's may differ; the model's counts."""
    settings = PssSettings.model_construct(
        model="standard", gain=-1.0, beta1=1.0, beta2=1.0, average="sensors", units=["G1", "G2"]
    )
    with pytest.raises(InputError) as caught:
        with_pss(miniwecc, settings)
    assert caught.value.findings == tuple(
        f"grid.pss: delta_omega.K of '{unit}' must be >= 0 pu (got -1)" for unit in ("G1", "G2")
    )


def test_groups_hold_every_device_once_with_its_parameters(tuned: Case) -> None:
    """A column in the wrong place would give a unit its neighbour's constants."""
    found = groups(tuned, {})
    assert sum(len(group.units) for group in found) == sum(map(len, tuned.devices.values()))
    for group in found:
        for column, unit in enumerate(group.units):
            device = tuned.device(group.role, tuned.units[unit])
            assert device is not None
            expected = [device.values[p.symbol] for p in group.model.parameters]
            np.testing.assert_array_equal(group.p[:, column], expected)


def test_a_substitute_takes_the_place_of_its_model_and_of_no_other(tuned: Case) -> None:
    """An experiment with one equation must leave all others alone."""

    class Other(ST3Potential):
        """The same equations under another name."""

    models = {group.model for group in groups(tuned, {ST3Potential: Other})}
    assert Other in models
    assert ST3Potential not in models
    assert {group.model for group in groups(tuned, {})} - models == {ST3Potential}

"""Cases as tables, and what the linearised equations say of them."""

import numpy as np
import pytest

import tieline
from tieline.linear import study


def test_a_case_is_read_as_tables_by_the_names_of_its_parts() -> None:
    """Rows under a wrong bus number or unit would be believed."""
    case = tieline.case("two_area")
    assert repr(case).startswith("Case two_area")
    data = case.data
    assert list(case.buses.index) == list(data.buses.number)
    ends = case.branches[["from_bus", "to_bus"]].to_numpy()
    assert set(ends.ravel()) <= set(case.buses.index)
    assert case.units["bus"].to_dict() == dict(
        zip(data.units, data.buses.number[data.unit_bus], strict=True)
    )
    assert case.units.loc["G1", "machine"] == data.device("machine", "G1").model.__name__


def test_the_power_flow_keeps_the_voltages_of_units() -> None:
    """A bus whose unit holds its voltage must come out at the voltage that it holds."""
    case = tieline.case("two_area")
    held = case.buses.index[case.buses["kind"] != "pq"]
    np.testing.assert_allclose(
        case.power_flow.loc[held, "v_pu"], case.buses.loc[held, "v_pu"], atol=1e-9
    )


def test_modes_and_responses_are_those_of_the_linear_analysis() -> None:
    """Two answers to one question would each be doubted."""
    by_case = tieline.modes(tieline.case("two_area"), pss="none")
    by_name = study.modes("two_area", pss="none")
    np.testing.assert_array_equal(by_case.eigenvalues, by_name.eigenvalues)
    loop = tieline.freqresp("two_area", "G1", 0.5, beta1=1, beta2=0.5)
    same = study.freqresp("two_area", "G1", 0.5, 1.0, 0.5)
    f_hz = np.array([0.1, 0.5])
    np.testing.assert_array_equal(loop.over(f_hz), same.over(f_hz))


def test_an_unknown_case_names_the_shipped_ones() -> None:
    """Otherwise a newcomer would have to look into the package."""
    with pytest.raises(tieline.InputError, match="miniwecc"):
        tieline.case("minwecc")

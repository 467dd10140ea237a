"""The miniWECC and a system built of it, shared by the grid's tests."""

import pytest

from tieline.grid.case import Case, load_case
from tieline.grid.devices import with_pss
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import PssSettings
from tieline.grid.system import System, build_system
from tieline.resources import case_folder


@pytest.fixture(scope="session")
def miniwecc() -> Case:
    """The shipped case."""
    return load_case(case_folder("miniwecc"))


@pytest.fixture(scope="session")
def flow(miniwecc: Case) -> PowerFlow:
    """Its power flow."""
    return solve_power_flow(miniwecc)


@pytest.fixture(scope="session")
def tuned(miniwecc: Case) -> Case:
    """The case with the generalised stabiliser of the G26 trip."""
    return with_pss(miniwecc, PssSettings(gain=9.0, beta1=1.0, beta2=0.5))


@pytest.fixture(scope="session")
def system(tuned: Case, flow: PowerFlow) -> System:
    """That case at rest, with the sensors' average formed at every step."""
    return build_system(tuned, flow, tuned.base.sensors)

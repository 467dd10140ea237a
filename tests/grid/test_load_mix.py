"""Another mix of loads in a case."""

import numpy as np
import pytest
from pydantic import ValidationError

from tieline.grid.case import Case
from tieline.grid.devices import groups
from tieline.grid.events import plan_events
from tieline.grid.load_mix import with_load_mix
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import GridSettings, LoadSettings
from tieline.grid.simulation import Grid
from tieline.grid.stabilisers import with_pss
from tieline.grid.system import build_system, rotor_average


def test_without_a_mix_the_case_is_itself(miniwecc: Case) -> None:
    """A setting that is not given changes nothing."""
    assert with_load_mix(miniwecc, None) is miniwecc


def test_a_mix_reaches_every_load_and_no_hvdc_terminal(miniwecc: Case) -> None:
    """A terminal of an HVDC line is no load, whatever share of the loads is constant power."""
    mixed = with_load_mix(miniwecc, LoadSettings(p_constant_power=0.3, p_constant_current=0.7))
    numbers = mixed.buses.number[mixed.loads.bus].tolist()
    assert sorted(numbers) == sorted(miniwecc.buses.number[miniwecc.loads.bus].tolist())
    for row, number in enumerate(numbers):
        is_terminal = number in (24, 49, 69, 113)
        assert bool(mixed.loads.is_hvdc[row]) is is_terminal
        assert mixed.loads.p_constant_power[row] == (0.0 if is_terminal else 0.3)
    assert len(groups(mixed, {})) == len(groups(miniwecc, {}))


def test_the_mix_that_the_case_has_gives_its_own_trajectory(
    miniwecc: Case, flow: PowerFlow
) -> None:
    """Constant-current active power is what the tables say already."""
    pss = GridSettings().pss
    events = [{"at": 0.1, "trip_generator": "G26"}]
    ends = []
    for case in (miniwecc, with_load_mix(miniwecc, LoadSettings(p_constant_current=1.0))):
        fitted = with_pss(case, pss)
        system = build_system(fitted, flow, fitted.base.sensors)
        planned = plan_events(fitted, GridSettings(events=events))
        grid = Grid(system, method="rk4", steps_per_second=240, events=planned)
        grid.advance(480)
        ends.append(grid.x)
    # The loads stand in another order, so that sums round otherwise.
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-9)


def test_shares_beyond_the_whole_are_refused() -> None:
    """Negative impedance would be the rest."""
    with pytest.raises(ValidationError, match="shares of p must sum to 1 at most"):
        LoadSettings(p_constant_power=0.6, p_constant_current=0.6)


@pytest.fixture(scope="module")
def benefit() -> dict[float, float]:
    """Return what beta2 = 0.67 against 0 adds to the nadir, Hz, by share of constant power."""
    from tieline.grid.case import load_case
    from tieline.resources import case_folder

    case = load_case(case_folder("two_area"))
    flow = solve_power_flow(case)
    gained = {}
    for share in (0.0, 0.25, 0.5):
        mix = LoadSettings(p_constant_power=share, p_constant_current=1.0 - share)
        nadirs = []
        for beta2 in (0.0, 0.67):
            pss = {"model": "generalized", "gain": 18.0, "beta1": 0.33, "beta2": beta2}
            settings = GridSettings(
                duration=12.0, pss=pss, events=[{"at": 1.0, "trip_generator": "G3"}]
            )
            fitted = with_pss(with_load_mix(case, mix), settings.pss)
            average = rotor_average(np.ones(4))
            system = build_system(fitted, flow, fitted.base.sensors, average)
            events = plan_events(fitted, settings)
            grid = Grid(system, method="rk4", steps_per_second=240, events=events)
            lowest = 60.0
            for tick in range(0, 12 * 240 + 1, 12):
                grid.advance(tick)
                lowest = min(lowest, 60.0 * grid.centre_of_inertia())
            nadirs.append(lowest)
        gained[share] = nadirs[1] - nadirs[0]
    return gained


def test_the_benefit_of_beta2_shrinks_as_the_share_of_constant_power_grows(
    benefit: dict[float, float],
) -> None:
    """The paper: beta2 works through the voltage, and constant power does not feel it."""
    assert benefit[0.0] > benefit[0.25] > benefit[0.5] > 0

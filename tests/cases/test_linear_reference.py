"""Modes of the three cases against PSTess 1.1; `expected/README.md` of each case has the source."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from grid.quirk import PSTessST3
from tieline.grid.case import Case, load_case
from tieline.grid.devices import with_pss
from tieline.grid.models.exciters.st3_potential import ST3Potential
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.sensors import A1, B
from tieline.grid.settings import PssSettings
from tieline.grid.system import System, build_system, rotor_average, sensor_average
from tieline.linear.linearise import linearise
from tieline.resources import case_folder
from tieline.tables import read_table

Complexes = NDArray[np.complex128]

CASES = ("two_area", "two_area_original", "miniwecc")
BAND_HZ = (0.02, 2.5)

EXACT = 1e-7
"""Relative; of shapes, of the largest. Both programs take finite differences that are good for
about 1e-8: the reference by its own account, ours by `differences.STEP`."""

SHIPPED, SHIPPED_MEDIAN = 4e-3, 1e-3
"""What feeding the bridge of an ST3 exciter with the true terminal voltage moves: the frequency
regulation by 3e-3, most modes by less than 4e-4."""

SHIPPED_SHAPE = 1e-2
"""A mode takes on its neighbours' shapes by about its shift over their distance: 2e-3 over 0.28 for
the swing near 0.37 Hz, which changes most of the named modes."""


def tables(name: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the reference's modes and mode shapes of a case."""
    folder = case_folder(name) / "expected" / "linear"
    return read_table(folder / "modes.parquet"), read_table(folder / "shapes.parquet")


RUNS = [(name, run) for name in CASES for run in tables(name)[0]["run"].unique()]
every_run = pytest.mark.parametrize(("name", "run"), RUNS)
every_miniwecc_run = pytest.mark.parametrize(
    "run", [run for name, run in RUNS if name == "miniwecc"]
)


@dataclass(frozen=True)
class Match:
    """A run's modes beside the reference's, in the order of its table.

    Attributes:
        expected, found: (modes,) eigenvalues, one to one.
        speeds: (units, modes) the rotor speeds in the found modes, not scaled.
        others: eigenvalues found in the band beyond the reference's.
        shapes: the reference's mode shapes of this run.
    """

    system: System
    expected: Complexes
    found: Complexes
    speeds: Complexes
    others: Complexes
    shapes: pd.DataFrame

    @property
    def errors(self) -> NDArray[np.float64]:
        """Return (modes,) the relative differences of the eigenvalues."""
        return np.abs(self.found - self.expected) / np.abs(self.expected)

    def shape_errors(self) -> dict[str, float]:
        """Return the largest difference of a speed in each named mode, where the largest is 1."""
        errors = {}
        for mode, rows in self.shapes.groupby("mode"):
            eigenvalue = complex(rows["real_1_per_s"].iloc[0], rows["imag_rad_per_s"].iloc[0])
            assert rows["unit"].tolist() == list(self.system.case.units)
            shape = rows["shape_re"].to_numpy() + 1j * rows["shape_im"].to_numpy()
            at = self.expected.tolist().index(eigenvalue)
            own = self.speeds[:, at]
            # By the unit that is largest in the reference: two may be equal but for rounding.
            own = own / own[np.abs(shape).argmax()]
            errors[str(mode)] = float(np.abs(own - shape).max())
        return errors


Matcher = Callable[..., Match]


@pytest.fixture(scope="module")
def match() -> Matcher:
    """A function that linearises a run and matches its modes, once for all tests."""
    cases = {name: load_case(case_folder(name)) for name in CASES}
    flows = {name: solve_power_flow(case) for name, case in cases.items()}

    @cache
    def of(name: str, run: str, substitute: bool) -> Match:
        modes, shapes = (table[table["run"] == run] for table in tables(name))
        system = system_of(cases[name], flows[name], modes.iloc[0], substitute)
        expected = modes["real_1_per_s"].to_numpy() + 1j * modes["imag_rad_per_s"].to_numpy()
        found, vectors = np.linalg.eig(linearise(system).A)
        upper = np.flatnonzero(found.imag > 0)
        distance = np.abs(found[upper][None, :] - expected[:, None]) / np.abs(expected)[:, None]
        _, columns = linear_sum_assignment(distance)
        at = upper[columns]
        is_other = (found.imag / (2 * np.pi) >= BAND_HZ[0]) & (found.imag <= 2 * np.pi * BAND_HZ[1])
        is_other[at] = False
        speeds = vectors[system.plan.average.omega][:, at]
        return Match(system, expected, found[at], speeds, found[is_other], shapes)

    return of


def system_of(case: Case, flow: PowerFlow, run: pd.Series, substitute: bool) -> System:
    """Return the system of a run of the reference, with its exciter if that is asked for."""
    numbers = {"gain": run["K_pu"], "beta1": run["beta1"], "beta2": run["beta2"]}
    given = {name: float(value) for name, value in numbers.items() if not np.isnan(value)}
    if run["average"] == "rotors":
        average = rotor_average(np.ones(len(case.units)))
    else:
        average = sensor_average(np.ones(len(case.base.sensors)))
    exciter = {ST3Potential: PSTessST3} if substitute else {}
    fitted = with_pss(case, PssSettings(model=run["pss"], **given))
    return build_system(fitted, flow, case.base.sensors, average, exciter)


@every_run
def test_every_mode_is_the_references(match: Matcher, name: str, run: str) -> None:
    """A wrong term anywhere, in any loop, would show in some mode of some tuning.

    The miniWECC has the reference's exciter here. The two-area system needs no other one than it
    is shipped with: its simple exciter differs in the anti-windup alone, which is at no limit here.
    """
    errors = match(name, run, True).errors
    assert len(errors) >= 8
    assert errors.max() < EXACT


@every_run
def test_what_the_reference_leaves_out_are_the_sensors_filters(
    match: Matcher, name: str, run: str
) -> None:
    """A mode too many would be one that the real system does not have.

    The reference has no filter where the average is that of rotors, else one on the mean angle.
    Each of the other filters here moves alone, without anybody seeing it.
    """
    found = match(name, run, True)
    filters = len(found.system.sensor_bus) - run.startswith("sensors")
    assert len(found.others) == filters
    own = np.roots([1.0, A1, B])
    np.testing.assert_allclose(found.others, own[own.imag > 0][0], rtol=EXACT)


@every_run
def test_every_named_mode_has_the_references_shape(match: Matcher, name: str, run: str) -> None:
    """Who swings against whom is what a mode is recognised by."""
    errors = match(name, run, True).shape_errors()
    assert len(errors) >= 2
    assert max(errors.values()) < EXACT


@every_miniwecc_run
def test_the_shipped_exciter_moves_modes_and_shapes_little(match: Matcher, run: str) -> None:
    """The standard's exciter is not the reference's; conclusions must not hang on which it is."""
    found = match("miniwecc", run, False)
    assert found.errors.max() < SHIPPED
    assert np.median(found.errors) < SHIPPED_MEDIAN
    assert max(found.shape_errors().values()) < SHIPPED_SHAPE

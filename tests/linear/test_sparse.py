"""Modes of the sparse descriptor form against those of dense matrices."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as matrices
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.grid.case import load_case
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.settings import PssSettings
from tieline.grid.stabilisers import with_pss
from tieline.grid.system import build_system, rotor_average
from tieline.grid.tile import TIE_REACTANCE_PU, strongest_buses, tiled
from tieline.linear import LinearSystem, Modes, linear, linearise, modes_of
from tieline.linear.sparse import Descriptor, descriptor, least_damped, modes_near
from tieline.resources import case_folder

Complexes = NDArray[np.complex128]

TILES = 4
TUNINGS = {
    "own": {"gain": 25.0, "beta1": 1.0, "beta2": 0.0},
    "average": {"gain": 9.0, "beta1": 0.0, "beta2": 0.5},
    "both": {"gain": 9.0, "beta1": 1.0, "beta2": 0.5},
}
BAND_HZ = (0.1, 1.0)
DAMPED = 0.3


@pytest.fixture(scope="module")
def system() -> LinearSystem:
    return linear("miniwecc", gain=9, beta1=1, beta2=0.5)


@pytest.fixture(scope="module")
def dense(system: LinearSystem) -> Modes:
    return modes_of(system)


@pytest.fixture(scope="module")
def sparse(system: LinearSystem) -> Descriptor:
    return descriptor(system)


def test_the_descriptor_reduces_to_the_state_matrix(sparse: Descriptor) -> None:
    """Both forms must be the same system."""
    n, full = sparse.states, sparse.matrix.toarray()
    reduced = full[:n, :n] - full[:n, n:] @ np.linalg.solve(full[n:, n:], full[n:, :n])
    A = sparse.linear.A
    # Differences of numbers of the size of the largest entry.
    assert np.abs(reduced - A).max() < 1e-10 * np.abs(A).max()


def test_the_least_damped_modes_of_a_band_are_those_of_the_dense_matrix(
    sparse: Descriptor, dense: Modes
) -> None:
    """A missing one could be the one that grows."""
    f = dense.frequency_hz
    fits = (f >= BAND_HZ[0]) & (f <= BAND_HZ[1]) & (dense.damping_ratio <= DAMPED)
    places = np.flatnonzero(fits)
    places = np.sort(places[np.argsort(dense.damping_ratio[places])][:10])
    found = least_damped(sparse, BAND_HZ, 10)
    np.testing.assert_allclose(found.eigenvalues, dense.eigenvalues[places], rtol=1e-9)
    for k, place in enumerate(places):
        np.testing.assert_allclose(found.shapes[:, k], dense.shapes[:, place], atol=1e-6)
        overlap = found.left[:, k].conj() @ found.right[:, k]
        assert overlap == pytest.approx(1.0, abs=1e-9)


def test_the_modes_nearest_to_a_point_are_found(sparse: Descriptor, dense: Modes) -> None:
    """Whoever knows where a mode is wants that one."""
    shift = -0.3 + 3.9j
    nearest = dense.eigenvalues[np.argsort(np.abs(dense.eigenvalues - shift))[:3]]
    found = modes_near(sparse, shift, 3).eigenvalues
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(nearest), rtol=1e-9)


def test_as_many_modes_as_half_the_states_can_be_asked_for(
    sparse: Descriptor, dense: Modes
) -> None:
    """The search space would be as large as the system: it is solved densely then."""
    found = modes_near(sparse, 1.0j, sparse.states // 2).eigenvalues
    assert len(found) == sparse.states // 2
    assert np.abs(found - 1.0j).max() <= np.sort(np.abs(dense.eigenvalues - 1.0j))[len(found) - 1]


def test_bands_and_shifts_that_cannot_be_are_refused(sparse: Descriptor) -> None:
    """A search of nothing would find nothing and look like an answer."""
    with pytest.raises(InputError, match="lowest < highest"):
        least_damped(sparse, (1.0, 0.1))
    with pytest.raises(InputError, match="imaginary part >= 0"):
        modes_near(sparse, -1.0 - 1.0j, 1)


def of_rotors(times: int, tuning: dict[str, float]) -> LinearSystem:
    """Several tiles whose stabilisers believe the equal mean of all rotor speeds."""
    case = with_pss(tiled(load_case(case_folder("miniwecc")), times), PssSettings(**tuning))
    average = rotor_average(np.ones(len(case.units)))
    return linearise(build_system(case, solve_power_flow(case), case.base.sensors, average))


def of_chain(one: LinearSystem, times: int) -> Complexes:
    """Every eigenvalue of a chain of tiles from matrices of the size of one.

    Tiles that swing as cos(pi j (k + 1/2) / times), k the tile, see through each tie a shunt of
    2 - 2 cos(pi j / times) times its admittance, and no average unless j = 0.
    """
    bus = strongest_buses(one.system.case)
    found = []
    for j in range(times):
        # A reactance alone: its current is -1j / X times the voltage.
        b = np.full(len(bus), (2.0 - 2.0 * np.cos(np.pi * j / times)) / TIE_REACTANCE_PU)
        entries = (
            np.concatenate([b, -b]),
            (np.r_[2 * bus, 2 * bus + 1], np.r_[2 * bus + 1, 2 * bus]),
        )
        shunt = matrices.csc_matrix(entries, shape=one.network.matrix.shape)
        network = replace(one.network, matrix=(one.network.matrix + shunt).tocsc())
        tile = replace(one, network=network)
        found.append(np.linalg.eigvals(tile.A if j == 0 else tile.A_without_average))
    return np.concatenate(found)


@pytest.mark.parametrize("tuning", list(TUNINGS))
def test_no_mode_of_a_chain_of_tiles_is_missing(tuning: str) -> None:
    """Tiles have families of nearly equal modes, of which a search may stop at the first."""
    every = of_chain(of_rotors(1, TUNINGS[tuning]), TILES)
    f_hz = every.imag / (2.0 * np.pi)
    within = every[(f_hz >= BAND_HZ[0]) & (f_hz <= BAND_HZ[1])]
    ratio = -within.real / np.abs(within)
    wanted = within[np.argsort(ratio)][: min(20, int((ratio <= DAMPED).sum()))]
    found = least_damped(descriptor(of_rotors(TILES, TUNINGS[tuning])), BAND_HZ, 20)
    # The derivatives of tiles differ in the rounding of their differences, by 1e-10.
    np.testing.assert_allclose(
        np.sort(found.damping_ratio), np.sort(-wanted.real / np.abs(wanted)), rtol=1e-8
    )
    distance = np.abs(found.eigenvalues[:, None] - wanted).min(axis=1)
    assert (distance / np.abs(found.eigenvalues)).max() < 1e-8
    product = found.left.conj().T @ found.right
    # Vectors of different discs are converged to 1e-9, over distances of some 1e-2.
    np.testing.assert_allclose(product, np.eye(len(wanted)), atol=1e-6)

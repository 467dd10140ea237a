"""Modes of the sparse descriptor form against those of the dense matrix."""

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.linear import LinearSystem, Modes, linear, modes_of
from tieline.linear.sparse import Descriptor, descriptor, least_damped, modes_near

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


def test_bands_and_shifts_that_cannot_be_are_refused(sparse: Descriptor) -> None:
    """A search of nothing would find nothing and look like an answer."""
    with pytest.raises(InputError, match="lowest < highest"):
        least_damped(sparse, (1.0, 0.1))
    with pytest.raises(InputError, match="imaginary part >= 0"):
        modes_near(sparse, -1.0 - 1.0j, 1)

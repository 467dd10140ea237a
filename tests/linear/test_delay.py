"""The eigenvalues of the loop with delays: two approximations and the exact equation."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import lambertw

from linear.delayed_loops import FASTEST, UNEQUAL, distance, inside, scalar, two_area
from tieline.errors import InputError, NumericalError
from tieline.linear._delay_roots import solve_shifted
from tieline.linear.delay import (
    damping_against_delay,
    delayed_eigenvalues,
    delayed_matrix,
    mode_with_delay,
    refined_mode,
)
from tieline.linear.linearise import LinearSystem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def characteristic(linear: LinearSystem, s: complex, delays_s: Floats) -> Complexes:
    """Return s I - A - b sum_k alpha_k exp(-s tau_k) c_k, written out."""
    late = (linear.average_weights * np.exp(-s * delays_s)) @ linear.average_rows
    A = linear.A_without_average
    return s * np.eye(len(A)) - A - np.outer(linear.by_average, late)


def test_the_hessenberg_solution_is_the_dense_one() -> None:
    """Every exact figure rests on this elimination, with and without an exchange of rows."""
    draw = np.random.default_rng(1)
    H = np.triu(draw.normal(size=(9, 9)), -1)
    first_row, s = draw.normal(size=9) + 1j * draw.normal(size=9), 0.3 + 1.1j
    right = draw.normal(size=(2, 9)) + 0j
    M = s * np.eye(9) - H
    M[0] -= first_row
    expected = np.linalg.solve(M, right.T).T
    np.testing.assert_allclose(solve_shifted(H, first_row, s, right, 1e-16), expected, rtol=1e-10)


@pytest.mark.parametrize("method", ["chebyshev", "pade"])
def test_the_scalar_equation_has_the_roots_of_lambert(method: str) -> None:
    """s = W_k(-a tau) / tau solves s + a exp(-s tau) = 0."""
    a, tau = 2.0, 0.9
    refined = delayed_eigenvalues(scalar(a), tau, method, refined=True)
    approximate = delayed_eigenvalues(scalar(a), tau, method)
    for k in range(-2, 2):
        root = complex(lambertw(-a * tau, k)) / tau
        assert abs(refined - root).min() < 1e-13 * abs(root)
        assert abs(approximate - root).min() < 1e-6 * abs(root)


def test_two_delays_of_one_equation_are_told_apart() -> None:
    """Both signals in one line, or weights in the wrong place, would give other roots."""
    a, early, late = 1.5, 0.3, 1.1
    roots = inside(delayed_eigenvalues(scalar(a, 2), [late, early], refined=True))
    assert len(roots) >= 2
    error = roots + 0.5 * a * (np.exp(-roots * early) + np.exp(-roots * late))
    assert np.abs(error / roots).max() < 1e-12


@pytest.mark.parametrize("delays_s", [0.1, 0.45, 1.25, UNEQUAL])
def test_both_approximations_agree_with_the_exact_equation(delays_s: float | list[float]) -> None:
    """The default order promises 1e-8 up to 2.5 Hz; 1e-9 leaves what 72 states round to."""
    linear = two_area()
    exact = inside(delayed_eigenvalues(linear, delays_s, refined=True))
    assert len(exact) >= 5
    for method in ("chebyshev", "pade"):
        approximate = delayed_eigenvalues(linear, delays_s, method)
        assert distance(exact, approximate) < 1e-9
        other = inside(delayed_eigenvalues(linear, delays_s, method, refined=True))
        assert len(other) == len(exact)
        assert distance(exact, other) < 1e-11
    delays = np.broadcast_to(delays_s, 4)
    for s in exact:
        mode = refined_mode(linear, s, delays_s)
        assert mode.residual < 1e-14
        M = characteristic(linear, mode.eigenvalue, delays)
        parts = np.abs(M) @ np.abs(mode.vector)
        assert (np.abs(M @ mode.vector) <= 1e-10 * parts + 1e-13).all()


@pytest.mark.parametrize("delays_s", [0.45, UNEQUAL])
def test_no_eigenvalue_inside_the_circle_is_missing(delays_s: float | list[float]) -> None:
    """The argument principle counts the zeros of det M(s), without any of the code tested here."""
    linear, delays = two_area(25.0, 0.0, 1.0), np.broadcast_to(delays_s, 4)
    circle = FASTEST * np.exp(2j * np.pi * np.arange(1500) / 1500)
    signs = [np.linalg.slogdet(characteristic(linear, s, delays))[0] for s in circle]
    turns = np.angle(np.array(signs) / np.roll(signs, 1))
    assert np.abs(turns).max() < 1.0
    values = delayed_eigenvalues(linear, delays_s, refined=True)
    assert (np.abs(values) < FASTEST).sum() == round(turns.sum() / (2.0 * np.pi))


def test_a_low_order_of_pade_is_worse_and_says_so_when_refined() -> None:
    """The second order that is often used is wrong by percents at 1.25 s."""
    linear = two_area()
    exact = inside(delayed_eigenvalues(linear, 1.25, refined=True))
    errors = [distance(exact, delayed_eigenvalues(linear, 1.25, "pade", n)) for n in (2, 8, 16)]
    assert errors[0] > 0.01
    assert errors[0] > errors[1] > errors[2]
    with pytest.raises(NumericalError, match=r"too low for a delay of 1\.25 s \(got 2\)"):
        delayed_eigenvalues(linear, 1.25, "pade", 2, refined=True)


def test_without_delay_the_matrix_is_the_undelayed_one() -> None:
    """A delay of zero is exact, alone and among others, and takes no states."""
    linear = two_area()
    n, rounding = len(linear.A), 1e-14 * np.abs(linear.A).max()
    np.testing.assert_allclose(delayed_matrix(linear, 0.0), linear.A, atol=rounding)
    assert delayed_matrix(linear, UNEQUAL, order=7).shape == (n + 14, n + 14)
    values = delayed_eigenvalues(linear, [0.0] * 4, refined=True)
    undelayed = np.linalg.eigvals(linear.A)
    assert len(values) == n
    assert distance(inside(undelayed), values) < 1e-9


def test_equal_delays_of_sensors_are_one_delay() -> None:
    """Sensor by sensor or all at once, it is the same network."""
    linear = two_area()
    each = delayed_matrix(linear, [0.3] * 4)
    np.testing.assert_array_equal(each, delayed_matrix(linear, 0.3))
    start = inside(np.linalg.eigvals(linear.A))[0]
    one = mode_with_delay(linear, start, [0.1, 0.3])
    np.testing.assert_allclose(mode_with_delay(linear, start, [[0.1] * 4, [0.3] * 4]), one)


@pytest.mark.parametrize(
    ("delays_s", "message"),
    [
        (-0.1, r"0, or from 1e-06 to 10\.0 s \(got -0\.1\)"),
        (float("nan"), r"\(got nan\)"),
        (float("inf"), r"\(got inf\)"),
        ([0.1, 0.1, -2.0, 0.1], r"\(got -2\.0 for member 2\)"),
        ([0.1, 0.2], r"one delay, or 4, .* \(got shape \(2,\)\)"),
    ],
)
def test_delays_are_checked(delays_s: float | list[float], message: str) -> None:
    """A negative delay would foretell, and a short list would delay the wrong sensors."""
    for function in (delayed_matrix, delayed_eigenvalues):
        with pytest.raises(InputError, match=message):
            function(two_area(), delays_s)
    with pytest.raises(InputError, match=message):
        refined_mode(two_area(), 1j, delays_s)
    with pytest.raises(InputError, match=message):
        damping_against_delay(two_area(), [delays_s])


def test_method_and_order_are_checked() -> None:
    """Each message names what was given and what is allowed."""
    with pytest.raises(InputError, match=r"no method 'pad' .*did you mean 'pade'"):
        delayed_matrix(two_area(), 0.1, "pad")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"order must be >= 1 \(got 0\)"):
        delayed_matrix(two_area(), 0.1, order=0)

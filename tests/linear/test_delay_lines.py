"""A delay as a line: its transfer function against exp(-s) and the polynomials of Padé."""

from math import comb, factorial

import numpy as np
import pytest

from tieline.linear._delay_lines import DelayLine, chebyshev_line, enough_order, pade_line


def passed(line: DelayLine, s: complex) -> complex:
    """Return the transfer function of a line."""
    return complex(line.h @ np.linalg.solve(s * np.eye(len(line.F)) - line.F, line.g) + line.d)


@pytest.mark.parametrize("order", range(1, 9))
def test_the_pade_line_is_the_ratio_of_polynomials(order: int) -> None:
    """A wrong coefficient would be another delay; 1e-13 is the rounding of 1/s to the eighth."""
    for s in (0.1 + 0.0j, 1.0j, 5.0j, -1.0 + 2.0j):
        terms = [
            comb(order, k) * factorial(2 * order - k) / factorial(2 * order) * s**k
            for k in range(order + 1)
        ]
        ratio = sum((-1) ** k * term for k, term in enumerate(terms)) / sum(terms)
        assert passed(pade_line(order), s) == pytest.approx(ratio, rel=1e-13, abs=1e-13)


def test_the_pade_line_is_balanced_and_passes_all_at_any_order() -> None:
    """The usual companion form has coefficients of 1e30 at this order and no digit left."""
    line = pade_line(24)
    np.testing.assert_allclose(line.F + line.F.T, -np.outer(line.g, line.g), atol=1e-10)
    np.testing.assert_allclose(line.F + line.F.T, -np.outer(line.h, line.h), atol=1e-10)
    for w in (0.3, 7.0, 20.0, 1000.0):
        assert abs(passed(line, 1j * w)) == pytest.approx(1.0, abs=1e-11)
    assert passed(line, 20j) == pytest.approx(np.exp(-20j), abs=1e-9)


def test_the_chebyshev_line_converges_faster_than_any_power() -> None:
    """Algebraic convergence would betray a wrong row of the differentiation matrix."""
    errors = [abs(passed(chebyshev_line(order), 8j) - np.exp(-8j)) for order in (12, 16, 20)]
    assert errors[0] < 1e-4
    # Each four points take more digits than the four before.
    assert errors[1] / errors[0] < 1e-2
    assert errors[2] / errors[1] < 1e-3


@pytest.mark.parametrize("phase", [0.1, 4.0, 12.0, 20.0])
def test_the_default_order_is_enough(phase: float) -> None:
    """The order is promised to hold exp(-s) to 1e-8 on the axis, 1e-6 left of it."""
    for method, line in (("chebyshev", chebyshev_line), ("pade", pade_line)):
        delay = line(enough_order(method, phase))
        for angle in np.linspace(np.pi / 2.0, np.pi, 5):
            s = phase * np.exp(1j * angle)
            allowed = 1e-8 if angle == np.pi / 2.0 else 1e-6
            assert abs(passed(delay, s) * np.exp(s) - 1.0) < allowed
        assert np.abs(np.linalg.eigvals(delay.F)).min() > phase

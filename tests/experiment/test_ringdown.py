"""Frequency and damping read off a ring-down, against signals whose modes are known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tieline.experiment.ringdown import matrix_pencil, ring_down

STEP_S = 0.05
TIME_S = np.arange(0.0, 15.0, STEP_S)
BAND_HZ = (0.2, 0.8)


def damped(frequency_hz: float, damping_ratio: float, phase: float = 0.3) -> NDArray[np.float64]:
    """Return a unit damped sinusoid from its damped frequency and damping ratio."""
    w = 2 * np.pi * frequency_hz
    decay = damping_ratio * w / np.sqrt(1 - damping_ratio**2)
    return np.asarray(np.exp(-decay * TIME_S) * np.cos(w * TIME_S + phase))


def surroundings() -> NDArray[np.float64]:
    """Return what stands round a tie mode: an offset, a slow drift and a local mode."""
    return 0.7 + 0.5 * np.exp(-0.3 * TIME_S) + 0.3 * damped(1.1, 0.07)


@pytest.mark.parametrize(
    ("frequency_hz", "damping_ratio"), [(0.35, 0.05), (0.35, 0.2), (0.6, 0.02), (0.25, -0.01)]
)
def test_a_clean_mode_is_exact(frequency_hz: float, damping_ratio: float) -> None:
    """Otherwise the estimator would have a bias of its own.

    A sum of exponentials is the method's own model, so only rounding remains.
    """
    found = ring_down(damped(frequency_hz, damping_ratio) + surroundings(), STEP_S, BAND_HZ).mode
    assert found is not None
    assert found.frequency_hz == pytest.approx(frequency_hz, rel=1e-9)
    assert found.damping_ratio == pytest.approx(damping_ratio, abs=1e-9)
    assert found.amplitude == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("frequency_hz", "damping_ratio"), [(0.35, 0.05), (0.6, 0.02), (0.25, -0.01), (0.4, 0.08)]
)
def test_a_noisy_mode_is_found_within_a_thousandth(
    frequency_hz: float, damping_ratio: float
) -> None:
    """Otherwise measurement noise could pass for a change of damping.

    0.5 % noise on 300 samples gives a standard deviation of 0.015-0.03 % in frequency and of
    0.0001-0.0003 in damping here; the bounds are more than three of them.
    """
    rng = np.random.default_rng(20)
    for phase in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        noise = 0.005 * rng.standard_normal(len(TIME_S))
        signal = damped(frequency_hz, damping_ratio, phase) + surroundings() + noise
        found = ring_down(signal, STEP_S, BAND_HZ).mode
        assert found is not None
        assert found.frequency_hz == pytest.approx(frequency_hz, rel=1e-3)
        assert found.damping_ratio == pytest.approx(damping_ratio, abs=2e-3)


def test_the_stronger_of_two_modes_is_chosen() -> None:
    """Otherwise a faint neighbour could be reported as the tie mode."""
    found = ring_down(damped(0.35, 0.05) + 0.3 * damped(0.6, 0.05), STEP_S, BAND_HZ).mode
    assert found is not None
    assert found.frequency_hz == pytest.approx(0.35, rel=1e-6)


def test_a_slow_drift_does_not_hide_a_small_swing() -> None:
    """Otherwise the settling of the frequency, which is far larger, would hide the swing."""
    found = ring_down(0.05 * damped(0.35, 0.1) + np.exp(-0.1 * TIME_S), STEP_S, BAND_HZ).mode
    assert found is not None
    assert found.frequency_hz == pytest.approx(0.35, rel=1e-6)


@pytest.mark.parametrize(
    ("signal", "reason"),
    [
        (TIME_S[:100] * 0, "shorter than"),
        (TIME_S * 0 + 3, "does not move"),
        (np.where(TIME_S > 5, np.nan, 1.0), "missing values"),
        (np.random.default_rng(1).standard_normal(len(TIME_S)), "leave"),
        (damped(1.1, 0.05), "no mode between 0.2 and 0.8 Hz"),
        (damped(1.1, 0.02) + 0.05 * damped(0.4, 0.05), "% of the swings"),
        (damped(0.4, 0.7), "damped too well"),
    ],
)
def test_without_a_clear_mode_the_reason_is_told(signal: NDArray[np.float64], reason: str) -> None:
    """Otherwise a table would show a damping that nothing supports."""
    found = ring_down(signal, STEP_S, BAND_HZ)
    assert found.mode is None
    assert found.reason is not None
    assert reason in found.reason


def test_the_parts_add_up_to_the_signal() -> None:
    """Otherwise energies and misfit would speak of another signal."""
    signal = damped(0.35, 0.05) + 0.5 * damped(0.9, 0.1)
    fit = matrix_pencil(signal, STEP_S)
    assert len(fit.poles) == 4
    np.testing.assert_allclose(np.sum(fit.parts, axis=0).real, signal, atol=1e-10)
    assert fit.misfit < 1e-10

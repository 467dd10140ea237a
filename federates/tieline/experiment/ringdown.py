"""Frequency and damping of a swing from its ring-down, by the matrix pencil method.

The samples are modelled as a sum of damped exponentials, y_n = sum_i R_i z_i^n. The poles z_i are
the generalised eigenvalues of a pencil of two shifted Hankel matrices, reduced to their signal
subspace by a singular value decomposition; the residues R_i follow by least squares.

Source: Y. Hua, T. K. Sarkar, 'Matrix pencil method for estimating parameters of exponentially
damped/undamped sinusoids in noise', IEEE Trans. Acoustics, Speech and Signal Processing 38 (1990)
814-824. Order: M. Gavish, D. L. Donoho, 'The optimal hard threshold for singular values is
4/sqrt(3)', IEEE Trans. Information Theory 60 (2014) 5040-5053. Not modelled: a changing operating
point; the window must lie after the last event.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEAST_RATIO = 1e-3
"""Singular values below this share of the largest are no signal, even without noise."""

MEDIAN_FACTOR = 2.858
"""Hard threshold over the median singular value for unknown white noise (square matrix)."""

LEAST_PERIODS = 2.0
"""Periods of the band's lowest frequency that the window must hold."""

LEAST_ENERGY_SHARE = 0.1
"""A mode with less of the swings' energy does not stand out."""

LARGEST_MISFIT = 0.3
"""Root-mean-square misfit, as a share of the signal's, beyond which the model does not hold."""

LARGEST_DAMPING_RATIO = 0.5
"""A mode damped beyond this is gone within a period: its frequency cannot be read off."""


@dataclass(frozen=True)
class Mode:
    """One oscillatory mode.

    Attributes:
        frequency_hz: damped frequency.
        damping_ratio: negative for a growing mode.
        amplitude: at the start of the window, in the signal's unit.
        energy_share: its energy against that of the signal without what is slower than the band;
            overlapping modes can bring it above one.
    """

    frequency_hz: float
    damping_ratio: float
    amplitude: float
    energy_share: float


@dataclass(frozen=True)
class RingDown:
    """The mode found, or None and the reason why none stands out."""

    mode: Mode | None
    reason: str | None = None


@dataclass(frozen=True)
class Exponentials:
    """A fitted sum of exponentials.

    Attributes:
        poles: (m,) continuous-time poles, 1/s.
        parts: (m, n) complex course of each exponential; their sum is the fit.
        misfit: root-mean-square misfit against that of the samples.
    """

    poles: NDArray[np.complex128]
    parts: NDArray[np.complex128]
    misfit: float


def matrix_pencil(samples: NDArray[np.float64], step_s: float) -> Exponentials:
    """Return the exponentials that make up equally spaced samples.

    Args:
        samples: (n,) signal, at least 8 values, not all zero.
        step_s: spacing, s.
    """
    count = len(samples)
    hankel = np.lib.stride_tricks.sliding_window_view(samples, count // 2 + 1)
    _, sizes, rows = np.linalg.svd(hankel, full_matrices=False)
    floor = max(LEAST_RATIO * sizes[0], MEDIAN_FACTOR * float(np.median(sizes)))
    # Noise that is larger than any mode still leaves one exponential to be judged.
    order = max(1, int(np.count_nonzero(sizes > floor)))
    subspace = rows[:order].T
    shift = np.linalg.lstsq(subspace[:-1], subspace[1:], rcond=None)[0]
    z = np.linalg.eigvals(shift).astype(np.complex128)
    z = z[np.abs(z) > np.finfo(float).tiny]
    powers = z[None, :] ** np.arange(count)[:, None]
    residues = np.linalg.lstsq(powers, samples.astype(np.complex128), rcond=None)[0]
    parts = (powers * residues).T
    misfit = np.linalg.norm(samples - np.sum(parts, axis=0).real) / np.linalg.norm(samples)
    poles = (np.log(z) / step_s).astype(np.complex128)
    return Exponentials(poles, parts, float(misfit))


def ring_down(
    samples: NDArray[np.float64], step_s: float, band_hz: tuple[float, float]
) -> RingDown:
    """Return the most energetic oscillatory mode of a band, or why none stands out.

    Args:
        samples: (n,) equally spaced signal after the last event; its mean does not matter.
        step_s: spacing, s.
        band_hz: lowest and highest frequency looked at, Hz.
    """
    window_s = len(samples) * step_s
    needed_s = LEAST_PERIODS / band_hz[0]
    if window_s < needed_s or len(samples) < 8:
        return RingDown(None, f"the window of {window_s:.3g} s is shorter than {needed_s:.3g} s")
    if not np.all(np.isfinite(samples)):
        return RingDown(None, "the signal has missing values in the window")
    swing = samples - np.mean(samples)
    if np.ptp(swing) <= 1e-12 * max(1.0, float(np.max(np.abs(samples)))):
        return RingDown(None, "the signal does not move in the window")
    fit = matrix_pencil(swing, step_s)
    if fit.misfit > LARGEST_MISFIT:
        return RingDown(None, f"damped exponentials leave {fit.misfit:.0%} of the signal")
    return _strongest(fit, swing, band_hz)


def _strongest(
    fit: Exponentials, swing: NDArray[np.float64], band_hz: tuple[float, float]
) -> RingDown:
    lowest, highest = band_hz
    frequency_hz = fit.poles.imag / (2 * np.pi)
    inside = np.flatnonzero((frequency_hz >= lowest) & (frequency_hz <= highest))
    if not len(inside):
        return RingDown(None, f"no mode between {lowest:g} and {highest:g} Hz")
    is_slow = np.abs(frequency_hz) < lowest
    energy = _energy(swing - np.sum(fit.parts[is_slow], axis=0).real)
    energies = [_energy(2 * fit.parts[i].real) for i in inside]
    strongest = int(np.argmax(energies))
    best, share = inside[strongest], energies[strongest] / energy
    pole = fit.poles[best]
    damping = float(-pole.real / np.abs(pole))
    if share < LEAST_ENERGY_SHARE:
        return RingDown(None, f"the strongest mode of the band has {share:.1%} of the swings")
    if damping > LARGEST_DAMPING_RATIO:
        return RingDown(None, f"the strongest mode of the band is damped too well ({damping:.2f})")
    amplitude = float(2 * np.abs(fit.parts[best, 0]))
    return RingDown(Mode(float(frequency_hz[best]), damping, amplitude, share))


def _energy(signal: NDArray[np.float64]) -> float:
    return float(np.sum(signal**2))

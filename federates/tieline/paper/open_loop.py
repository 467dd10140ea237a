"""The open loop of G2 in the miniWECC: what the weights do to it, and what delay does."""

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from tieline.linear import LinearSystem, linear, open_loop, zeros
from tieline.linear.plots import bode, pole_zero
from tieline.linear.response import decibel, frequencies
from tieline.paper.item import Drawn, Found, Item, Work
from tieline.paper.sources import LINEAR, PSTESS, REFERENCE
from tieline.paper.statement import Band, Statement, about

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

UNIT = "G2"
PEAKS_HZ = ((0.04, 0.005), (0.37, 0.005), (0.62, 0.005), (1.0, 0.05))
"""Peaks that the paper names, and half of the last digit that it gives."""

SLOW, SWINGS = 0, (1, 2, 3)
BAND_HZ = (0.02, 2.0)
ZERO_BAND_HZ = (0.1, 0.2)
ZERO_REAL = (-0.2, 0.2)
LATEST_S = 1.25
REFERENCE_HZ = 0.0439
"""Where the reference's table of gain changes was read off its grid of frequencies."""


@cache
def _linear(beta1: float, beta2: float, average: str = "sensor") -> LinearSystem:
    settings = {"gain": 1.0, "beta1": beta1, "beta2": beta2, "units": [UNIT], "average": average}
    return linear("miniwecc", [UNIT], **settings)


def _over(
    f: Floats, beta1: float, beta2: float, delay_s: float = 0, of: str = "sensor"
) -> Complexes:
    return open_loop(_linear(beta1, beta2, of), UNIT, delay_s).over(f)


@cache
def _peaks() -> tuple[float, ...]:
    """Return the frequencies of the peaks nearest to those that the paper names, Hz."""
    f = np.geomspace(*BAND_HZ, 400)
    gain = decibel(_over(f, 1.0, 1.0))
    tops = 1 + np.flatnonzero((gain[1:-1] > gain[:-2]) & (gain[1:-1] > gain[2:]))
    found = []
    for hz, _ in PEAKS_HZ:
        top = tops[np.argmin(np.abs(f[tops] - hz))]
        best = minimize_scalar(
            lambda at: -decibel(_over(np.array([at]), 1.0, 1.0))[0],
            bounds=(f[top - 1], f[top + 1]),
            method="bounded",
            options={"xatol": 1e-5},
        )
        found.append(float(best.x))
    return tuple(found)


def _weights(work: Work) -> Found:
    peaks = np.array(_peaks())
    whole = _over(peaks, 1.0, 1.0)
    by_beta1 = _over(peaks, 0.2, 1.0) / whole
    changes = {of: _over(peaks[:1], 1.0, 0.2, of=of) / _over(peaks[:1], 1.0, 1.0, of=of)
               for of in ("sensor", "rotor")}  # fmt: skip
    at = np.array([REFERENCE_HZ])
    numbers = {f"peak_{i}": hz for i, hz in enumerate(peaks)}
    numbers |= {
        "beta1_slow_db": abs(decibel(by_beta1)[SLOW]),
        "beta1_swing_db": decibel(by_beta1)[[*SWINGS]].max(),
        "beta1_phase": np.abs(np.angle(by_beta1[[2, 3]], deg=True)).max(),
        "beta1_phase_037": abs(np.angle(by_beta1[1], deg=True)),
        "beta2_db": decibel(changes["sensor"])[0],
        "beta2_phase": np.angle(changes["sensor"][0], deg=True),
        "beta2_db_rotors": decibel(changes["rotor"])[0],
        "beta2_phase_rotors": np.angle(changes["rotor"][0], deg=True),
        "beta2_db_reference": decibel(_over(at, 1.0, 0.2) / _over(at, 1.0, 1.0))[0],
    }
    f = frequencies(BAND_HZ, 150 if work.quick else 400)
    figures = {
        "g2_beta1": Drawn(
            bode({f"beta1 = {b:g}": _over(f, b, 1.0) for b in (0.2, 0.5, 1.0)}, f),
            "beta2 = 1. beta1 raises the gain at the swings and none at the lowest peak, "
            "frequency regulation.",
        ),
        "g2_beta2": Drawn(
            bode({f"beta2 = {b:g}": _over(f, 1.0, b) for b in (0.2, 0.5, 1.0)}, f),
            "beta1 = 1. beta2 sets the gain at frequency regulation and leaves the swings above.",
        ),
    }
    return Found(numbers, figures)


def _delays(work: Work) -> list[float]:
    return [0.0, 0.5, 1.0, 1.25] if work.quick else [0.0, 0.25, 0.5, 0.75, 1.0, 1.25]


def _delay(work: Work) -> Found:
    peaks = np.array(_peaks())
    f = frequencies(BAND_HZ, 150 if work.quick else 400)
    prompt, late = (_over(f, 1.0, 0.5, delay) for delay in (0.0, LATEST_S))
    change = np.abs(decibel(late / prompt))
    at_peaks = _over(peaks, 1.0, 0.5, LATEST_S) / _over(peaks, 1.0, 0.5)
    equal, equal_late = (_over(f, 1.0, 1.0, delay) for delay in (0.0, LATEST_S))
    numbers = {
        "peak_db": np.abs(decibel(at_peaks)).max(),
        "swing_phase": np.abs(np.angle(at_peaks[[*SWINGS]], deg=True)).max(),
        "most_db": change.max(),
        "most_hz": f[change.argmax()],
        "most_at_db": decibel(prompt)[change.argmax()],
        "peak_gain_db": decibel(prompt).max(),
        "equal": np.abs(equal_late / equal - 1.0).max(),
    }
    curves = {f"{delay:g} s": _over(f, 1.0, 0.5, delay) for delay in _delays(work)}
    caption = (
        "(beta1, beta2) = (1, 0.5), the average late by 0 to 1.25 s. The peaks stay; what moves is "
        "the notch below the swings, where the gain is small."
    )
    return Found(numbers, {"g2_delay": Drawn(bode(curves, f), caption)})


def _zeros(work: Work) -> Found:
    loop = _linear(0.5, 1.0)
    found = {
        delay: zeros(open_loop(loop, UNIT, delay), ZERO_BAND_HZ, ZERO_REAL)
        for delay in _delays(work)
    }
    rightmost = [
        max(values, key=lambda zero: zero.real) for values in found.values() if len(values)
    ]
    numbers = {"first_real": rightmost[0].real, "last_real": rightmost[-1].real}
    for (early, one), (late, other) in pairwise(zip(found, rightmost, strict=True)):
        if one.real < 0 <= other.real:
            part = -one.real / (other.real - one.real)
            numbers["crossing_s"] = early + part * (late - early)
            numbers["crossing_hz"] = (one + part * (other - one)).imag / (2 * np.pi)
    f = frequencies(BAND_HZ, 150 if work.quick else 400)
    curves = {f"{delay:g} s": _over(f, 0.5, 1.0, delay) for delay in _delays(work)}
    poles = np.linalg.eigvals(loop.A).astype(np.complex128)
    named = {f"{delay:g} s": values for delay, values in found.items()}
    figures = {
        "g2_delay_exchanged": Drawn(
            bode(curves, f),
            "(beta1, beta2) = (0.5, 1). A notch near 0.12 Hz deepens as the average comes later; "
            "where its zero crosses the axis, the phase takes the other way round.",
        ),
        "g2_zeros": Drawn(
            pole_zero(poles, named, ZERO_BAND_HZ),
            "The zero of that notch: right of the axis from a delay between 1 and 1.25 s on.",
        ),
    }
    return Found(numbers, figures)


WEIGHTS = Item(
    "open_loop",
    "miniWECC: open loop of G2",
    "the open-loop frequency response of G2 with beta1 and with beta2 varied",
    "H = -v_s / V_ref of G2, the only unit with a stabiliser, K = 1, average of 30 PMUs",
    (
        *(
            Statement(
                f"ol-peak-{hz:g}", f"H peaks near {hz:g} Hz", LINEAR, f"peak_{i}", f"{hz:g} Hz",
                about(hz, within), "half of the last digit given", unit="Hz", digits=".4f",
            )
            for i, (hz, within) in enumerate(PEAKS_HZ)
        ),
        Statement(
            "ol-b1-slow", "beta1 has no effect on the gain at the frequency-regulation mode",
            LINEAR, "beta1_slow_db", "0 dB", Band(high=0.5),
            "half a decibel, beta1 from 1 to 0.2, cannot be seen in the plot", unit="dB",
        ),
        Statement(
            "ol-b1-swings", "less beta1 lowers the gain at the swings", LINEAR, "beta1_swing_db",
            "lower",
            Band(high=-3.0), "by 3 dB at least at each, beta1 from 1 to 0.2", unit="dB",
            digits=".1f",
        ),
        Statement(
            "ol-b1-phase", "beta1 leaves the phase at the swings alone: at 0.62 and 1 Hz",
            REFERENCE, "beta1_phase", "0 degrees", Band(high=5.0),
            "five degrees, beta1 from 1 to 0.2", unit="degrees", digits=".1f",
        ),
        Statement(
            "ol-b1-phase-037", "beta1 leaves the phase at the swings alone: at 0.37 Hz",
            REFERENCE, "beta1_phase_037", "0 degrees",
            Band(high=5.0), "five degrees, beta1 from 1 to 0.2",
            difference="the author's toolbox gives 13 to 21 degrees there on these data, too; "
            "what makes the paper's figure differ is not known",
            unit="degrees", digits=".1f",
        ),
        Statement(
            "ol-b2-gain", "going beta2 = 1 to 0.2 lowers the gain at the frequency-regulation mode "
            "by roughly 14 dB", LINEAR, "beta2_db", "-14 dB", about(-14, 1),
            "'roughly': one decibel", about(-14, 3),
            "20 log10(0.2) = -14.0 dB needs G2 to move exactly with the average; "
            "with the average of the rotors it is {beta2_db_rotors:.1f} dB",
            unit="dB", digits=".2f",
        ),
        Statement(
            "ol-b2-phase", "and advances the phase at the frequency-regulation mode by roughly 35 "
            "degrees", LINEAR,
            "beta2_phase", "+35 degrees", about(35, 2.5), "'roughly': half of the step to 40",
            about(35, 7.5),
            "the PMUs' filter; with the average of the rotors it is "
            "{beta2_phase_rotors:.1f} degrees", unit="degrees", digits=".1f",
        ),
        Statement(
            "ol-b2-pstess", "the gain change by beta2 at 0.0439 Hz", PSTESS, "beta2_db_reference",
            "-11.808 dB", about(-11.808, 0.05),
            "the exciters of the two programs differ; the same tables with its exciter agree to "
            "1e-7 dB (tests)", unit="dB",
        ),
    ),
    _weights,
)  # fmt: skip

DELAY = Item(
    "open_loop_delay",
    "miniWECC: open loop of G2 with a late average, (1, 0.5)",
    "the open-loop frequency response of G2 with beta1 = 1, beta2 = 0.5 under delays to 1.25 s",
    "H as before, the local speed undelayed, every PMU's frequency times exp(-s tau)",
    (
        Statement(
            "ol-delay-peaks", "with (1, 0.5) a delay of 1.25 s hardly alters H: gain at its peaks",
            LINEAR, "peak_db", "hardly", Band(high=2.0), "2 dB, a quarter of the amplitude",
            unit="dB", digits=".2f",
        ),
        Statement(
            "ol-delay-phase", "the same: phase at the swings", LINEAR, "swing_phase", "hardly",
            Band(high=15.0), "15 degrees, a quarter of a usual phase margin", unit="degrees",
            digits=".1f",
        ),
        Statement(
            "ol-delay-band", "the same: gain anywhere from 0.02 to 2 Hz", LINEAR, "most_db",
            "hardly",
            Band(high=2.0), "2 dB, a quarter of the amplitude", Band(high=10.0),
            "in the notch at {most_hz:.3f} Hz, where the gain is {most_at_db:.0f} dB against "
            "{peak_gain_db:.0f} dB at the highest peak, a late average moves it", unit="dB",
            digits=".2f",
        ),
        Statement(
            "ol-delay-equal", "beta1 = beta2 is immune to delay", LINEAR, "equal",
            "no effect", Band(high=1e-9), "the average drops out; rounding is left", digits=".1e",
        ),
    ),
    _delay,
)  # fmt: skip

ZEROS = Item(
    "open_loop_zeros",
    "miniWECC: open loop of G2 with a late average, (0.5, 1)",
    "the open-loop frequency response and zeros of G2 with beta1 = 0.5, beta2 = 1 under delays",
    "zeros of H between 0.1 and 0.2 Hz for each delay, and where they cross the imaginary axis",
    (
        Statement(
            "ol-zero-first", "with (0.5, 1) and no delay the zero lies left of the imaginary axis",
            LINEAR, "first_real", "left", Band(high=-1e-3), "its sign is stated", unit="1/s",
            digits=".4f",
        ),
        Statement(
            "ol-zero-last", "with (0.5, 1) and a delay of 1.25 s the zero has crossed that axis",
            LINEAR,
            "last_real", "right", Band(low=1e-4), "its sign is stated", unit="1/s", digits=".4f",
        ),
        Statement(
            "ol-zero-hz", "it crosses between 0.1 and 0.2 Hz", LINEAR, "crossing_hz",
            "0.1 to 0.2 Hz",
            Band(0.1, 0.2), "as stated", unit="Hz", digits=".4f",
        ),
    ),
    _zeros,
)  # fmt: skip

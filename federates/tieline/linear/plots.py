"""Figures of linear analysis: root loci, mode shapes, Bode, Nyquist, poles and zeros, damping."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tieline.figures import PANEL_INCHES, colours
from tieline.linear.modes import BAND_HZ, Modes
from tieline.linear.response import decibel, phase_deg
from tieline.linear.sweep import Sweep

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

MARKERS = {
    "frequency regulation": "s",
    "inter-area": "o",
    "local": "^",
    "control": ".",
    "real": "x",
}
DAMPING_LINES = (0.05, 0.1, 0.2)
"""Damping ratios that are drawn as rays."""


def pole_map(modes: Modes, band_hz: tuple[float, float] = BAND_HZ) -> Figure:
    """Return the modes within a band in the complex plane, by kind."""
    figure = Figure(figsize=(6.3, 4.2), layout="constrained")
    axes = figure.subplots()
    inside = modes.within(band_hz)
    kinds = [modes.kinds[k] for k in inside]
    for number, kind in enumerate(kind for kind in MARKERS if kind in kinds):
        at = inside[[other == kind for other in kinds]]
        points = modes.eigenvalues[at]
        colour = "0.6" if kind == "control" else f"C{number}"
        axes.plot(
            points.real, points.imag / (2 * np.pi), MARKERS[kind], ms=4, label=kind, color=colour
        )
    mechanical = [k for k in inside if modes.kinds[k] not in ("control", "real")]
    if mechanical:
        # Controls reach far to the left of what swings.
        axes.set_xlim(left=2.0 * min(-0.1, modes.eigenvalues[mechanical].real.min()))
    _complex_plane(axes)
    axes.legend(loc="upper left")
    return figure


def root_locus(sweep: Sweep) -> Figure:
    """Return the tracks of a sweep in the complex plane; colour is the value, marker the kind."""
    figure = Figure(figsize=(6.3, 4.6), layout="constrained")
    axes = figure.subplots()
    low, high = sweep.values.min(), sweep.values.max()
    norm = mpl.colors.Normalize(low, high)
    shade = None
    for place, track, group in zip(sweep.places, sweep.tracks, sweep.groups, strict=True):
        x, y = track.eigenvalues.real, track.frequency_hz
        axes.plot(x, y, color="0.75", linewidth=0.7, zorder=1)
        shade = axes.scatter(
            x, y, c=track.values, norm=norm, cmap="viridis", s=12,
            marker=MARKERS[sweep.start.kinds[place]], zorder=2,
        )  # fmt: skip
        if group == "A":
            axes.annotate(
                group, (x[-1], y[-1]), xytext=(3, 2), textcoords="offset points", fontsize=7
            )
    if shade is not None:
        figure.colorbar(shade, ax=axes, label=sweep.parameter)
    _complex_plane(axes)
    kinds = [sweep.start.kinds[place] for place in sweep.places]
    for kind in (kind for kind in MARKERS if kind in kinds):
        axes.plot([], [], MARKERS[kind], color="0.4", ms=4, label=kind)
    axes.legend()
    return figure


def mode_shapes(modes: Modes, places: Sequence[int]) -> Figure:
    """Return the shapes of some modes in the rotor speeds, as arrows from one point each."""
    columns = min(3, max(1, len(places)))
    rows = max(1, -(-len(places) // columns))
    figure = Figure(figsize=(2.2 * columns, 2.5 * rows), layout="constrained")
    panels = figure.subplots(
        rows, columns, squeeze=False, subplot_kw={"projection": "polar"}
    ).ravel()
    units = modes.linear.system.case.units
    for axes, k in zip(panels, places, strict=False):
        shape = modes.shapes[:, k]
        for unit in np.argsort(-np.abs(shape)):
            size, angle = abs(shape[unit]), np.angle(shape[unit])
            axes.annotate(
                "", (angle, size), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": "C0"}
            )
        for unit in np.argsort(-np.abs(shape))[:4]:
            axes.text(np.angle(shape[unit]), abs(shape[unit]) + 0.12, units[unit], fontsize=6)
        axes.set_rlim(0, 1.25)
        axes.set_rticks([0.5, 1.0])
        axes.set_xticklabels([])
        axes.set_yticklabels([])
        axes.set_title(f"{modes.frequency_hz[k]:.3f} Hz, {modes.kinds[k]}", fontsize=7)
    for axes in panels[len(places) :]:
        axes.remove()
    return figure


def bode(responses: Mapping[str, Complexes], frequency_hz: Floats) -> Figure:
    """Return gain and phase of some responses (points,) against frequency, by label."""
    figure = Figure(figsize=(6.3, 5.0), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for (label, values), colour in zip(responses.items(), colours(len(responses)), strict=True):
        gain.semilogx(frequency_hz, decibel(values), color=colour, label=label)
        phase.semilogx(frequency_hz, _wrapped_together(phase_deg(values)), color=colour)
    gain.set_ylabel("gain, dB")
    phase.set_ylabel("phase, degrees")
    phase.set_xlabel("frequency, Hz")
    if len(responses) > 1:
        gain.legend(ncols=2)
    gain.margins(x=0)
    return figure


def nyquist(loops: Mapping[str, Complexes]) -> Figure:
    """Return loops (points,) in the complex plane, with the point -1."""
    figure = Figure(figsize=(4.6, 4.4), layout="constrained")
    axes = figure.subplots()
    for (label, values), colour in zip(loops.items(), colours(len(loops)), strict=True):
        axes.plot(values.real, values.imag, color=colour, label=label)
    axes.plot([-1.0], [0.0], "+", color="black", ms=9)
    axes.axhline(0.0, color="0.8", linewidth=0.6)
    axes.axvline(0.0, color="0.8", linewidth=0.6)
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.set_aspect("equal", adjustable="datalim")
    if len(loops) > 1:
        axes.legend()
    return figure


def pole_zero(
    poles: Complexes, zeros: Mapping[str, Complexes], band_hz: tuple[float, float]
) -> Figure:
    """Return poles and the zeros of some responses within a band of the complex plane."""
    figure = Figure(figsize=(6.3, 4.0), layout="constrained")
    axes = figure.subplots()
    f = poles.imag / (2 * np.pi)
    inside = poles[(f >= band_hz[0]) & (f <= band_hz[1])]
    axes.plot(inside.real, inside.imag / (2 * np.pi), "x", color="0.5", label="poles")
    for (label, found), colour in zip(zeros.items(), colours(len(zeros)), strict=True):
        axes.plot(found.real, found.imag / (2 * np.pi), "o", color=colour, mfc="none", label=label)
    reach = 1.3 * max([abs(z.real) for found in zeros.values() for z in found], default=0.5)
    axes.set_xlim(-reach, max(0.1, reach if _any_right(zeros) else 0.1))
    _complex_plane(axes)
    axes.legend(title="zeros", title_fontsize=8)
    return figure


def damping_against_delay(
    delays_s: Floats, curves: Mapping[str, Complexes], margin_s: float | None
) -> Figure:
    """Return damping ratio and frequency of some modes against the delay of the average.

    Args:
        delays_s: (points,).
        curves: (points,) eigenvalues of each mode, by label.
        margin_s: the delay margin, or None.
    """
    figure = Figure(figsize=(6.3, 4.6), layout="constrained")
    ratio, frequency = figure.subplots(2, 1, sharex=True)
    for (label, path), colour in zip(curves.items(), colours(len(curves)), strict=True):
        ratio.plot(delays_s, -path.real / np.abs(path), color=colour, label=label)
        frequency.plot(delays_s, path.imag / (2 * np.pi), color=colour)
    if margin_s is not None:
        for axes in (ratio, frequency):
            axes.axvline(margin_s, color="0.4", linestyle=":", linewidth=0.9)
    ratio.axhline(0.0, color="0.5", linewidth=0.7)
    ratio.set_ylabel("damping ratio")
    frequency.set_ylabel("frequency, Hz")
    frequency.set_xlabel("delay of the average, s")
    ratio.margins(x=0)
    ratio.legend()
    return figure


def damping_in_time(time_s: Floats, curves: Mapping[str, Floats]) -> Figure:
    """Return the time-varying damping coefficient of some units."""
    figure = Figure(figsize=PANEL_INCHES, layout="constrained")
    axes = figure.subplots()
    for (unit, values), colour in zip(curves.items(), colours(len(curves)), strict=True):
        axes.plot(time_s, values, color=colour, label=unit)
    axes.axhline(0.0, color="0.5", linewidth=0.7)
    axes.set_xlabel("time, s")
    axes.set_ylabel("damping coefficient D(t), pu")
    axes.margins(x=0)
    axes.legend(ncols=2)
    return figure


def _any_right(zeros: Mapping[str, Complexes]) -> bool:
    return any(z.real > 0 for found in zeros.values() for z in found)


def _complex_plane(axes: Axes) -> None:
    axes.axvline(0.0, color="0.4", linewidth=0.8)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    right = max(right, 0.02 * (right - left))
    left = max(left, -1.5 * 2 * np.pi * high)
    for ratio in DAMPING_LINES:
        slope = np.sqrt(1.0 - ratio**2) / ratio / (2 * np.pi)
        axes.plot([0.0, left], [0.0, -slope * left], color="0.85", linewidth=0.7, zorder=0)
        if high < -slope * left:
            axes.annotate(
                f"{100 * ratio:.0f} %", (-high / slope, high), fontsize=6, color="0.5", ha="right"
            )
    axes.set_xlim(left, right)
    axes.set_ylim(max(low, 0.0), high)
    axes.set_xlabel("real part, 1/s")
    axes.set_ylabel("frequency, Hz")


def _wrapped_together(phase: Floats) -> Floats:
    """Return an unwrapped phase moved by whole turns so that it begins between -180 and 180."""
    moved: Any = phase - 360.0 * np.round(phase[0] / 360.0)
    return np.asarray(moved, np.float64)

"""Frequency responses with delayed averages, their zeros, and gain and phase margins.

The average that stabilisers believe is wbar = sum_k alpha_k e^(-s tau_k) c_k x, each sensor with a
delay of its own, while the unit's own speed is local and undelayed. With A0 the state matrix for a
constant average and b what the average does,

    (s I - A0 - b sum_k alpha_k e^(-s tau_k) c_k) x = B u

is solved frequency by frequency in complex Schur form, where A0 is triangular; the delayed loop has
rank one and is put in by the Sherman-Morrison formula.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import AAA

from tieline.compiled import compiled
from tieline.errors import InputError
from tieline.linear._delay_roots import delays_of
from tieline.linear.linearise import LinearSystem, linearise
from tieline.linear.retune import retuned

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

LEAD_LAGS = (("T1", "T2"), ("T3", "T4"), ("T5", "T6"))
"""Symbols of a stabiliser's leads, each with its lag."""

ZERO_TOLERANCE = 1e-9
"""Largest last step of Newton's method at a zero, 1/s."""

_NEWTON_STEPS = 40
_BESIDE = 3e-3
_STRAYS = 1.0
_CONTOUR_POINTS = 240


@dataclass(frozen=True)
class Response:
    """The transfer function from one input to one output of a linear system.

    Attributes:
        linear: the system.
        input, output: their names, as `LinearSystem.inputs` and `.outputs` have them.
        delay_s: (members,) delay of each member of the average.
        sign: factor on the whole, such as -1 for the paper's open loop.
    """

    linear: LinearSystem
    input: str
    output: str
    delay_s: Floats
    sign: float = 1.0

    def at(self, s: ArrayLike) -> Complexes:
        """Return the transfer function at complex frequencies `s` (any shape), 1/s."""
        points = np.asarray(s, np.complex128)
        values = np.array([self._at(point) for point in points.ravel()], np.complex128)
        return values.reshape(points.shape)

    def over(self, frequency_hz: ArrayLike) -> Complexes:
        """Return the frequency response at real frequencies, Hz."""
        return self.at(2j * np.pi * np.asarray(frequency_hz, np.float64))

    def _at(self, s: complex) -> complex:
        form = self._form
        late = (form.weights * np.exp(-s * self.delay_s)) @ form.members
        by_input, by_average = _solve(form.triangle, s, form.columns)
        believed = (late @ by_input) / (1.0 - late @ by_average)
        x = by_input + believed * by_average
        direct = form.direct + form.direct_average * believed
        return complex(self.sign * (form.row @ x + direct))

    @cached_property
    def _form(self) -> "_SchurForm":
        linear = self.linear
        triangle, unitary = linear.triangular
        row, believed = linear.C_without_average([self.output])
        adjoint = unitary.conj().T
        columns = np.column_stack([linear.B([self.input])[:, 0], linear.by_average])
        return _SchurForm(
            triangle=triangle,
            columns=np.ascontiguousarray((adjoint @ columns).T),
            row=row[0] @ unitary,
            members=linear.average_rows @ unitary,
            weights=linear.average_weights,
            direct=float(linear.D([self.output], [self.input])[0, 0]),
            direct_average=float(believed[0]),
        )


class _SchurForm(NamedTuple):
    # Everything in the coordinates in which A_without_average is triangular.
    triangle: Complexes
    columns: Complexes
    row: Complexes
    members: Complexes
    weights: Floats
    direct: float
    direct_average: float


@compiled
def _solve(triangle: Complexes, s: complex, columns: Complexes) -> Complexes:
    """Return (2, n) the solutions of (s I - T) x = column for an upper triangular T."""
    x = np.empty_like(columns)
    n = len(triangle)
    for i in range(n - 1, -1, -1):
        first, second = columns[0, i], columns[1, i]
        for j in range(i + 1, n):
            first += triangle[i, j] * x[0, j]
            second += triangle[i, j] * x[1, j]
        pivot = s - triangle[i, i]
        x[0, i], x[1, i] = first / pivot, second / pivot
    return x


def response(
    linear: LinearSystem,
    input_: str,
    output: str,
    delay_s: float | Sequence[float] = 0.0,
    sign: float = 1.0,
) -> Response:
    """Return a transfer function.

    Args:
        linear: the system, loops open as it was linearised.
        input_: name of the input, such as `Vref.G2`.
        output: name of the output, such as `pss.G2`.
        delay_s: delay of the average, one for all of its members or one each.
        sign: factor on the whole.

    Raises:
        InputError: an input, output or delay that cannot be.
    """
    found = Response(linear, input_, output, delays_of(linear, delay_s), sign)
    # Names are looked up when the first value is asked for: an unknown one is to be refused here.
    found.at(1j)
    return found


def open_loop(linear: LinearSystem, unit: str, delay_s: float | Sequence[float] = 0.0) -> Response:
    """Return the open loop H(s) = -v_s / V_ref of one unit, whose stabiliser must be cut.

    The stabiliser acts at the exciter's summing point with the sign of the reference, so that with
    the minus the closed loop is 1 + H(s), as the paper has it.

    Raises:
        InputError: the unit is unknown, or its stabiliser is not cut from its exciter.
    """
    if unit in linear.system.case.units:
        at = linear.system.case.units.index(unit)
        if not linear.severed[at]:
            raise InputError(f"the stabiliser of {unit} must be cut: linearise(system, ['{unit}'])")
    return response(linear, f"Vref.{unit}", f"pss.{unit}", delay_s, sign=-1.0)


def uncompensated(linear: LinearSystem, unit: str) -> LinearSystem | None:
    """Return the system with the leads of one unit's stabiliser equal to its lags.

    What is left of the stabiliser is its washout and gain, so that the open loop's quotient with
    and without leads is what the stabiliser compensates. None where it has no `LEAD_LAGS`.

    Raises:
        InputError: the unit has no stabiliser.
    """
    case = linear.system.case
    for group in linear.system.groups:
        rows = group.units.tolist()
        if group.role != "pss" or case.units.index(unit) not in rows:
            continue
        column = rows.index(case.units.index(unit))
        symbols = [parameter.symbol for parameter in group.model.parameters]
        found = {
            lead: float(group.p[symbols.index(lag), column])
            for lead, lag in LEAD_LAGS
            if lead in symbols and lag in symbols
        }
        if not found:
            return None
        system = retuned(linear.system, "pss", found, [unit])
        return linearise(system, np.array(case.units)[linear.severed].tolist())
    raise InputError(f"unit '{unit}' has no stabiliser")


def decibel(values: Complexes) -> Floats:
    """Return the gain of a response, dB."""
    return np.asarray(20.0 * np.log10(np.abs(values)), np.float64)


def phase_deg(values: Complexes) -> Floats:
    """Return the unwrapped phase of a response over ascending frequencies, degrees."""
    return np.asarray(np.rad2deg(np.unwrap(np.angle(values))), np.float64)


class Margins(NamedTuple):
    """How far a loop 1 + H is from instability, at every crossing.

    Attributes:
        gain_db: (m,) what the gain may rise (or must fall, if negative) at each frequency
            `gain_hz` where the phase is 180 degrees.
        phase_deg: (p,) what the phase may fall at each frequency `phase_hz` of gain 1.
        delay_s: (p,) the extra loop delay that would use up each phase margin.
    """

    gain_hz: Floats
    gain_db: Floats
    phase_hz: Floats
    phase_deg: Floats
    delay_s: Floats


def margins(
    loop: Response,
    gain: float = 1.0,
    band_hz: tuple[float, float] = (0.01, 10.0),
    points: int = 600,
) -> Margins:
    """Return the margins of the loop gain * H within a band, crossings refined by bisection.

    Args:
        loop: H, so that the closed loop is 1 + gain * H.
        gain: factor on H.
        band_hz: where crossings are looked for.
        points: samples in the band, evenly spaced in the logarithm.
    """
    f = np.geomspace(*band_hz, points)
    values = gain * loop.over(f)
    of_gain = _crossings(f, decibel(values), lambda at: decibel(gain * loop.over(at)))
    # The imaginary part changes sign where the phase is 0 or 180 degrees.
    real_at = _crossings(f, values.imag, lambda at: (gain * loop.over(at)).imag)
    real_at = real_at[[value.real < 0 for value in gain * loop.over(real_at)]]
    phase = np.angle(gain * loop.over(of_gain), deg=True)
    margin = (phase + 180.0) % 360.0
    return Margins(
        gain_hz=real_at,
        gain_db=-decibel(gain * loop.over(real_at)),
        phase_hz=of_gain,
        phase_deg=np.where(margin > 180.0, margin - 360.0, margin),
        delay_s=margin / 360.0 / of_gain,
    )


def _crossings(f: Floats, values: Floats, at: Callable[[Floats], Floats]) -> Floats:
    """Return where a function changes its sign, bisected between samples."""
    found = []
    for i in np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0):
        low, high, sign = f[i], f[i + 1], np.sign(values[i])
        for _ in range(50):
            middle = np.sqrt(low * high)
            if np.sign(at(np.array([middle]))[0]) == sign:
                low = middle
            else:
                high = middle
        found.append(np.sqrt(low * high))
    return np.array(found)


def zeros(
    function: Response,
    band_hz: tuple[float, float],
    real_1_per_s: tuple[float, float] = (-0.5, 0.5),
) -> Complexes:
    """Return the zeros (m,) of a response within a box of the complex plane, 1/s, by frequency.

    A rational function is fitted to the edge of the box (the AAA algorithm, Nakatsukasa, Sete and
    Trefethen, SIAM J. Sci. Comput. 40, 2018); each of its zeros in the box is the start of Newton's
    method on the response itself, delays and all.

    Args:
        function: the response.
        band_hz: frequencies, Hz, between which the imaginary part lies.
        real_1_per_s: between which the real part lies.
    """
    low, high = (2.0 * np.pi * f for f in band_hz)
    left, right = real_1_per_s
    corners = [left + 1j * low, right + 1j * low, right + 1j * high, left + 1j * high]
    edge = np.concatenate([
        np.linspace(start, end, _CONTOUR_POINTS // 4, endpoint=False)
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True)
    ])  # fmt: skip
    inside = np.linspace(left, right, 9)[1:-1, None] + 1j * np.linspace(low, high, 33)[None, 1:-1]
    samples = np.concatenate([edge, inside.ravel()])
    fit = AAA(samples, function.at(samples), rtol=1e-9, max_terms=80)
    # Zeros that all but cancel a pole are not in the fit: they are looked for beside the poles.
    poles = np.diag(function.linear.triangular[0])
    starts = np.concatenate([fit.roots(), poles + _BESIDE, poles - _BESIDE])
    found: list[complex] = []
    for start in starts:
        margin = 0.05 * (right - left) + 0.05j * (high - low)
        if not (left - margin.real < start.real < right + margin.real):
            continue
        if not (low - margin.imag < start.imag < high + margin.imag):
            continue
        zero = _newton(function, complex(start))
        is_inside = zero is not None and left <= zero.real <= right and low <= zero.imag <= high
        if is_inside and all(abs(zero - other) > 1e-6 for other in found):  # type: ignore[operator]
            found.append(complex(zero))  # type: ignore[arg-type]
    return np.array(sorted(found, key=lambda zero: zero.imag), np.complex128)


def _newton(function: Response, start: complex) -> complex | None:
    """Return the zero near a start, None where Newton's method does not end at one."""
    s = start
    for _ in range(_NEWTON_STEPS):
        step = 1e-6 * max(1.0, abs(s))
        here, ahead, behind = function.at(np.array([s, s + step, s - step]))
        slope = (ahead - behind) / (2.0 * step)
        if slope == 0.0:
            return None
        change = here / slope
        s -= change
        if not abs(s - start) < _STRAYS:
            return None
        if abs(change) < ZERO_TOLERANCE:
            return complex(s)
    return None


def frequencies(band_hz: tuple[float, float] = (0.01, 10.0), points: int = 400) -> Floats:
    """Return frequencies evenly spaced in the logarithm, Hz."""
    return np.geomspace(*band_hz, points)

"""The modes of a linear system: what swings, who takes part, and what kind of mode it is.

With A = sum_k lambda_k r_k l_k^H and l_k^H r_k = 1, the participation of state i in mode k is
p_ik = r_ik conj(l_ik), the controllability by an input b is l_k^H b, the observability in an
output c is c r_k, and the residue of the pair is their product. Source: Kundur, Power System
Stability and Control, 1994, section 12.2.

The rule by which modes are named. With m_i = H_i S_i the stored energy of unit i, phi_i its speed
in the mode shape and W = sum m_i |phi_i|^2, a set of units moves as a whole with the share
|sum m_i phi_i|^2 / (sum m_i) of W; the centre of inertia and the areas of the case are such sets.

    real                  no oscillation
    control               less than `MECHANICAL` of the participation lies in speeds and angles
    frequency regulation  the centre of inertia holds most of W, and every speed that is seen is
                          within `IN_PHASE_DEG` of it
    inter-area            any other of whose W the areas' centres hold at least `BY_AREAS`
    local                 any other: units swing against units of their own area
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import eig

from tieline.grid.average import inertia
from tieline.linear.linearise import LinearSystem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Kind = Literal["real", "control", "frequency regulation", "local", "inter-area"]

MECHANICAL = 0.3
IN_PHASE_DEG = 60.0
BY_AREAS = 1.0 / 3.0

BAND_HZ = (0.02, 2.5)
"""Where electromechanical modes are looked for."""

OSCILLATES_RAD_S = 1e-6
"""Imaginary parts below are rounding."""

SEEN = 0.05
"""A speed smaller than this part of the largest is not asked for its phase."""


@dataclass(frozen=True)
class Modes:
    """All eigenvalues of a linear system with both vectors, in ascending order of frequency.

    Attributes:
        linear: the system.
        eigenvalues: (m,) 1/s; of a pair only the one with positive imaginary part.
        right: (n, m) right eigenvectors; left: (n, m) left ones, scaled so that l^H r = 1. The
            vectors of equal eigenvalues, as unobserved PMU filters have them, mean nothing.
    """

    linear: LinearSystem
    eigenvalues: Complexes
    right: Complexes
    left: Complexes

    @property
    def frequency_hz(self) -> Floats:
        """Return (m,) the frequencies of oscillation."""
        return self.eigenvalues.imag / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> Floats:
        """Return (m,) the damping ratios, negative where a mode grows; 1 at the origin."""
        size = np.abs(self.eigenvalues)
        return np.where(size > 0, -self.eigenvalues.real / np.where(size > 0, size, 1.0), 1.0)

    @cached_property
    def participation(self) -> Floats:
        """Return (n, m) the size of each state's participation, scaled to sum 1 in each mode."""
        size = np.abs(self.right * self.left.conj())
        with np.errstate(invalid="ignore"):
            shares: Floats = size / size.sum(axis=0)
        return shares

    @cached_property
    def mechanical_share(self) -> Floats:
        """Return (m,) the part of the participation that lies in rotor speeds and angles."""
        system = self.linear.system
        places = np.concatenate([system.plan.average.omega, system.delta])
        share: Floats = self.participation[places].sum(axis=0)
        return share

    @cached_property
    def shapes(self) -> Complexes:
        """Return (units, m) the mode shapes in the rotor speeds, the largest scaled to 1."""
        speeds = self.right[self.linear.system.plan.average.omega]
        largest = speeds[np.argmax(np.abs(speeds), axis=0), np.arange(speeds.shape[1])]
        return speeds / np.where(largest == 0, 1.0, largest)

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """Return what kind of mode each is, by the rule of this module."""
        return tuple(self._kind(k) for k in range(len(self.eigenvalues)))

    def within(self, band_hz: tuple[float, float] = BAND_HZ) -> NDArray[np.int64]:
        """Return the places of the modes that oscillate within a band, Hz."""
        f = self.frequency_hz
        return np.flatnonzero((f >= band_hz[0]) & (f <= band_hz[1]))

    def of_kind(self, *kinds: Kind) -> NDArray[np.int64]:
        """Return the places of the modes of some kinds within the usual band."""
        return np.array([k for k in self.within() if self.kinds[k] in kinds], np.int64)

    def nearest(self, eigenvalue: complex) -> int:
        """Return the place of the mode nearest to an eigenvalue."""
        return int(np.argmin(np.abs(self.eigenvalues - eigenvalue)))

    def controllability(self, inputs: Sequence[str]) -> Complexes:
        """Return (m, inputs) how strongly inputs move each mode."""
        return np.asarray(self.left.conj().T @ self.linear.B(inputs), np.complex128)

    def observability(self, outputs: Sequence[str]) -> Complexes:
        """Return (outputs, m) how strongly each mode shows in outputs."""
        return np.asarray(self.linear.C(outputs) @ self.right, np.complex128)

    def residues(self, output: str, input_: str) -> Complexes:
        """Return (m,) the residues of the transfer function from an input to an output."""
        seen, moved = self.observability([output])[0], self.controllability([input_])[:, 0]
        return np.asarray(seen * moved, np.complex128)

    def table(self, band_hz: tuple[float, float] = BAND_HZ, states: int = 3) -> pd.DataFrame:
        """Return the modes that oscillate within a band, a row each, with who takes part most."""
        units = self.linear.system.case.units
        rows = []
        for k in self.within(band_hz):
            most = np.argsort(-self.participation[:, k])[:states]
            shape = self.shapes[:, k]
            leaders = np.argsort(-np.abs(shape))[:states]
            rows.append(
                {
                    "real_1_per_s": self.eigenvalues[k].real,
                    "imag_rad_per_s": self.eigenvalues[k].imag,
                    "frequency_Hz": self.frequency_hz[k],
                    "damping_ratio": self.damping_ratio[k],
                    "kind": self.kinds[k],
                    "mechanical_share": self.mechanical_share[k],
                    "states": ", ".join(self.linear.states[i] for i in most),
                    "shape": ", ".join(_polar(units[i], shape[i]) for i in leaders),
                }
            )
        return pd.DataFrame(rows, columns=list(COLUMNS))

    def shape_table(self, k: int) -> pd.DataFrame:
        """Return the shape of one mode in the speeds, a row a unit, size and angle in degrees."""
        shape = self.shapes[:, k]
        units = list(self.linear.system.case.units)
        return pd.DataFrame(
            {"unit": units, "size": np.abs(shape), "angle_deg": np.angle(shape, deg=True)}
        )

    def _kind(self, k: int) -> Kind:
        if abs(self.eigenvalues[k].imag) < OSCILLATES_RAD_S:
            return "real"
        if not self.mechanical_share[k] >= MECHANICAL:
            return "control"
        shape, mass = self.shapes[:, k], self._stored_energy
        total = (mass * np.abs(shape) ** 2).sum()
        centre = (mass * shape).sum()
        seen = np.abs(shape) > SEEN
        away = np.abs(np.angle(shape * np.conj(centre), deg=True))
        whole = abs(centre) ** 2 / mass.sum() / total
        if whole > 0.5 and away[seen].max() <= IN_PHASE_DEG:
            return "frequency regulation"
        of_areas = sum(
            abs((mass * shape)[area].sum()) ** 2 / mass[area].sum() for area in self._areas
        )
        return "inter-area" if of_areas >= BY_AREAS * total else "local"

    @cached_property
    def _stored_energy(self) -> Floats:
        case = self.linear.system.case
        return inertia(case) * case.unit_MVA

    @cached_property
    def _areas(self) -> list[NDArray[np.bool_]]:
        """Return (units,) for each area that has a unit with inertia, which units are in it."""
        case = self.linear.system.case
        area_of = np.array(case.buses.area)[case.unit_bus]
        areas = [area_of == area for area in np.unique(area_of)]
        return [area for area in areas if self._stored_energy[area].sum() > 0]


COLUMNS = {
    "real_1_per_s": "real part of the eigenvalue, 1/s",
    "imag_rad_per_s": "imaginary part, rad/s",
    "frequency_Hz": "frequency of oscillation, Hz",
    "damping_ratio": "damping ratio, negative where the mode grows",
    "kind": "by the rule of tieline.linear.modes",
    "mechanical_share": "part of the participation in rotor speeds and angles",
    "states": "the states that take part most",
    "shape": "the largest speeds of the mode shape, size and angle in degrees",
}
"""Columns of `Modes.table` and what they say."""


def modes_of(linear: LinearSystem) -> Modes:
    """Return the modes of a linear system, all of them, dense (LAPACK geev)."""
    eigenvalues, left, right = eig(linear.A, left=True, right=True)
    kept = np.flatnonzero(eigenvalues.imag >= 0)
    order = kept[np.lexsort((eigenvalues.real[kept], eigenvalues.imag[kept]))]
    left, right = left[:, order], right[:, order]
    scale = np.einsum("ik,ik->k", left.conj(), right)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = left / scale.conj()
    return Modes(linear, eigenvalues[order], right, left)


def _polar(unit: str, value: complex) -> str:
    return f"{unit} {abs(value):.2f}/{np.angle(value, deg=True):.0f}"

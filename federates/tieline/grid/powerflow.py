"""The power flow: Newton's method in polar coordinates with a sparse Jacobian.

Source: Kundur, Power System Stability and Control, 1994, section 6.4.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from tieline.errors import NumericalError
from tieline.grid.case import Case
from tieline.grid.network import admittance

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TOLERANCE_PU = 1e-10
"""Largest power mismatch. Newton's last step squares the error, so it ends far below this."""


@dataclass(frozen=True)
class PowerFlow:
    """A solved operating point: arrays (n,), system base, radians.

    Attributes:
        v, theta: voltages; p_gen, q_gen: what the units inject.
        iterations: Newton steps taken; mismatch: largest power mismatch left.
    """

    v: Floats
    theta: Floats
    p_gen: Floats
    q_gen: Floats
    iterations: int
    mismatch: float

    @property
    def phasor(self) -> NDArray[np.complex128]:
        """Return the complex voltages."""
        return self.v * np.exp(1j * self.theta)


# What overflows on the way ends as a mismatch that is not finite, and is refused as such.
@np.errstate(all="ignore")
def solve_power_flow(case: Case, *, max_iterations: int = 30) -> PowerFlow:
    """Return the operating point that the case's schedule gives.

    Raises:
        NumericalError: Newton's method does not converge, or a unit's reactive power lies outside
            its limits; the message names the bus.
    """
    buses = case.buses
    y = admittance(buses, case.branches).tocsr()
    kinds = np.array(buses.kind)
    free_angle = np.flatnonzero(kinds != "slack")
    free_v = np.flatnonzero(kinds == "pq")
    scheduled = buses.p_gen - buses.p_load - 1j * buses.q_load
    v, theta = buses.v.copy(), buses.theta.copy()
    for iteration in range(max_iterations + 1):
        phasor = v * np.exp(1j * theta)
        excess = phasor * (y @ phasor).conj() - scheduled
        mismatch = np.concatenate([excess.real[free_angle], excess.imag[free_v]])
        largest = float(np.abs(mismatch).max(initial=0.0))
        if not np.isfinite(largest) or v.min() <= 0:
            break
        if largest < TOLERANCE_PU:
            s_gen = excess + scheduled + buses.p_load + 1j * buses.q_load
            flow = PowerFlow(v, theta, s_gen.real, s_gen.imag, iteration, largest)
            _check_reactive_limits(case, flow)
            return flow
        step = _solve(case, _jacobian(y, phasor, free_angle, free_v), -mismatch)
        theta[free_angle] += step[: len(free_angle)]
        v[free_v] += step[len(free_angle) :]
    worst = int(np.argmax(np.abs(mismatch)))
    bus = buses.number[np.concatenate([free_angle, free_v])[worst]]
    raise NumericalError(
        f"the power flow of case '{case.name}' diverged after {iteration} iterations: mismatch "
        f"{mismatch[worst]:.3g} pu at bus {bus}; check its schedule, load and branches"
    )


def _solve(case: Case, jacobian: sparse.csc_matrix, right: Floats) -> Floats:
    try:
        return np.asarray(splu(jacobian).solve(right), np.float64)
    except RuntimeError as error:
        raise NumericalError(
            f"the power flow of case '{case.name}' has a singular Jacobian; a bus may hang on the "
            f"rest by no branch ({error})"
        ) from error


def _jacobian(
    y: sparse.csr_matrix, phasor: NDArray[np.complex128], free_angle: Integers, free_v: Integers
) -> sparse.csc_matrix:
    """Return d(P, Q)/d(theta, V), with dS/dtheta = j V (I - Y V)* and dS/dV = V (Y e)* + I* e."""
    v = sparse.diags(phasor)
    unit = sparse.diags(phasor / np.abs(phasor))
    current = sparse.diags((y @ phasor).conj())
    by_angle = (1j * v @ (current - (y @ v).conj())).tocsr()
    by_v = (v @ (y @ unit).conj() + current @ unit).tocsr()
    blocks = [
        [by_angle[free_angle][:, free_angle].real, by_v[free_angle][:, free_v].real],
        [by_angle[free_v][:, free_angle].imag, by_v[free_v][:, free_v].imag],
    ]
    return sparse.bmat(blocks, format="csc")


def _check_reactive_limits(case: Case, flow: PowerFlow) -> None:
    """Raise for units beyond their limits; equal limits stand for none.

    Raises:
        NumericalError: a bus's reactive generation lies outside; names each.
    """
    buses = case.buses
    has_limit = buses.q_gen_max > buses.q_gen_min
    outside = has_limit & ((flow.q_gen > buses.q_gen_max) | (flow.q_gen < buses.q_gen_min))
    lines = [
        f"bus {buses.number[i]}: reactive power {flow.q_gen[i]:.4g} pu outside "
        f"[{buses.q_gen_min[i]:g}, {buses.q_gen_max[i]:g}] pu"
        for i in np.flatnonzero(outside)
    ]
    if lines:
        raise NumericalError("the power flow violates reactive limits:\n" + "\n".join(lines))

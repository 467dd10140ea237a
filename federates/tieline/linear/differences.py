"""The derivatives of every block of a system, from the very equations that are integrated.

A block (a unit with its controls, or a bus filter) answers to its own states and to few local
inputs: the voltage of its bus, the average that it believes, the stabiliser's output that its
exciter is given, its references. So one evaluation of all equations moves the same column of every
block at once, and a system of any size needs as many as its largest block has columns.

The stabilisers' outputs are cut from the exciters here: what stabilisers give is a quantity of its
own, `PSS_OUT`, and what exciters get is an input, so that loops can be opened and closed at will.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.blocks import Blocks
from tieline.grid.equations import rhs_at_voltages, show_voltages
from tieline.grid.models.base import SIGNALS
from tieline.grid.plan import Plan, Work

Floats = NDArray[np.float64]

V_S = SIGNALS.index("v_s")
PSS_OUT = len(SIGNALS)
"""Row, beyond the signals', of what the stabilisers give."""

V_RE, V_IM, WBAR, V_S_IN, V_REF, P_REF, W_0 = range(7)
"""Columns of `Local.by_input`: bus voltage, average, the exciter's v_s, references."""

_SIGNAL_INPUTS = np.array([SIGNALS.index(n) for n in ("wbar", "v_s", "Vref", "Pref", "w0")])
INPUTS = 2 + len(_SIGNAL_INPUTS)

STEP = 1e-5
"""Distance of the samples of a difference, pu or rad: small, because a stabiliser of high gain and
a long lead answers a thousandfold, and must not reach its limit on the way. The rounding that is
left, 1e-10 of the largest term of an equation, moves no eigenvalue by more than 1e-8."""

KINK = 1e-3
"""Relative difference of two quotients that is taken for a limiter at work."""


class Local(NamedTuple):
    """Derivatives at one point, by block.

    Attributes:
        by_state: (blocks, size, size) df/dx within each block, 0 in empty places.
        by_input: (blocks, size, INPUTS) df/dz.
        signals_by_state: (rows, units, size) of each unit's signals, the last row `PSS_OUT`.
        signals_by_input: (rows, units, INPUTS).
    """

    by_state: Floats
    by_input: Floats
    signals_by_state: Floats
    signals_by_input: Floats


def severed(plan: Plan, work: Work) -> tuple[Plan, Work]:
    """Return plan and work in which stabilisers write `PSS_OUT` and exciters read a constant."""
    outputs = np.where(plan.jobs.outputs == V_S, PSS_OUT, plan.jobs.outputs)
    signals = np.concatenate([work.signals, work.signals[V_S : V_S + 1]])
    copy = Work._make(array.copy() for array in work._replace(signals=signals))
    return plan._replace(jobs=plan.jobs._replace(outputs=outputs)), copy


def local_derivatives(functions: Any, plan: Plan, work: Work, blocks: Blocks, x: Floats) -> Local:
    """Return the derivatives at `x`, at the voltages and inputs that `work` holds for it.

    At the corner of a limiter the smaller of both sides' slopes is taken: what stands at its limit
    does not move.
    """
    plan, work = severed(plan, work)
    width = blocks.place.shape[1]
    rows, units = work.signals.shape
    f = np.zeros((width + INPUTS, len(x)))
    signals = np.zeros((width + INPUTS, rows, units))
    _differentiate(functions, plan, work, blocks, x, _SIGNAL_INPUTS, f, signals)
    by_block = np.where(blocks.place >= 0, f[:, blocks.place], 0.0).transpose(1, 2, 0)
    by_unit = signals.transpose(1, 2, 0)
    return Local(
        np.ascontiguousarray(by_block[:, :, :width]),
        np.ascontiguousarray(by_block[:, :, width:]),
        np.ascontiguousarray(by_unit[:, :, :width]),
        np.ascontiguousarray(by_unit[:, :, width:]),
    )


@compiled
def _differentiate(
    functions: Any,
    plan: Plan,
    work: Work,
    blocks: Blocks,
    x: Floats,
    signal_inputs: NDArray[np.int64],
    f: Floats,
    signals: Floats,
) -> None:
    """Write df (columns, n) and the derivatives of the signals (columns, rows, units)."""
    count, width = blocks.place.shape
    v, held = work.v.copy(), work.signals.copy()
    samples_f = np.zeros((5, len(x)))
    samples_s = np.zeros((5, *held.shape))
    rhs_at_voltages(functions, plan, work, x, samples_f[2])
    samples_s[2] = work.signals
    for column in range(f.shape[0]):
        for sample in (0, 1, 3, 4):
            move = (sample - 2) * STEP
            moved = x.copy()
            work.signals[:] = held
            if column < width:
                for b in range(count):
                    if blocks.place[b, column] >= 0:
                        moved[blocks.place[b, column]] += move
            elif column < width + 2:
                work.v[:] = v + move * (1.0 if column == width else 1.0j)
                show_voltages(plan, work)
            else:
                work.signals[signal_inputs[column - width - 2]] += move
            rhs_at_voltages(functions, plan, work, moved, samples_f[sample])
            samples_s[sample] = work.signals
        for i in range(len(x)):
            f[column, i] = _slope(samples_f[:, i])
        for row in range(held.shape[0]):
            for unit in range(held.shape[1]):
                signals[column, row, unit] = _slope(samples_s[:, row, unit])
        work.v[:] = v
    work.signals[:] = held


@compiled
def _slope(at: Floats) -> float:
    """Return the derivative at the middle of five samples, `STEP` apart."""
    up, down = (at[3] - at[2]) / STEP, (at[2] - at[1]) / STEP
    inner, outer = 0.5 * (up + down), (at[4] - at[0]) / (4.0 * STEP)
    if abs(up - down) > KINK * max(abs(up), abs(down)):
        bend, wide_bend = abs(up - down), abs(at[4] - 2.0 * at[2] + at[0]) / (2.0 * STEP)
        # The slopes of a smooth function differ the more the wider the samples; a corner's do not.
        if bend > 0.75 * wide_bend:
            return up if abs(up) < abs(down) else down
    if abs(inner - outer) > KINK * abs(inner):
        return inner
    return (4.0 * inner - outer) / 3.0

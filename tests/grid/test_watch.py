"""What is recorded on the way against what is seen by stopping and looking."""

import numpy as np
import pytest

from grid.runs import G26_AT_100_MS, disturbed
from tieline.grid.system import System

RATE, PER_ROW, SIGNALS = 240, 4, ("omega", "vt", "Efd", "Pe")


@pytest.mark.parametrize(("method", "until"), [("rk4", 60), ("trapezoid", 36)])
def test_rows_are_what_stopping_at_their_instants_would_show(
    system: System, method: str, until: int
) -> None:
    """A row from inside the steps that was a stage, or before an event, would be a false record."""
    kept: list[np.ndarray] = []
    recorded = disturbed(system, method, RATE, G26_AT_100_MS)
    scale = np.ones((len(SIGNALS), len(system.case.units)))
    scale[3] = 0.01
    recorded.record(PER_ROW, SIGNALS, scale, 3, lambda rows: kept.append(rows.copy()))
    recorded.advance(until)
    recorded.record_now()
    looked_at = disturbed(system, method, RATE, G26_AT_100_MS)
    expected = []
    for tick in range(0, until + 1, PER_ROW):
        looked_at.advance(tick)
        values = [looked_at.signal(name) for name in SIGNALS]
        expected.append(
            np.concatenate(
                [
                    [tick / RATE, looked_at.centre_of_inertia()],
                    *values[:3],
                    0.01 * values[3],
                    looked_at.reading().f_hz,
                    np.abs(looked_at.voltages()),
                ]
            )
        )
    assert [len(rows) for rows in kept[:-1]] == [3] * (len(kept) - 1)
    # The same numbers; only the magnitude of a voltage comes from another library's root.
    np.testing.assert_allclose(np.concatenate(kept), expected, rtol=4e-16, atol=0)

"""What the PMUs put into their frames."""

import numpy as np
import pytest

from tieline.c37118 import DataFrame
from tieline.c37118.batch import stream_config
from tieline.units import tick_ns
from tieline.wams import PmuReporter

EPOCH_S = 1_700_000_000


def test_a_frame_says_what_was_measured_where_and_when() -> None:
    """Otherwise controllers steer by another quantity than the one that the grid has."""
    reporter = PmuReporter([1, 300], [500e3, 20e3], EPOCH_S)
    v = np.array([1.05 * np.exp(0.3j), 0.98 * np.exp(-0.1j)])
    rows = reporter.frames(tick_ns(61, 60), v, np.array([59.75, 60.5]), np.array([-0.25, 0.5]))
    assert rows.shape == (2, 34)
    assert rows.dtype == np.uint8
    expected_v = v * np.array([500e3, 20e3]) / np.sqrt(3.0)
    for i, idcode in enumerate((1, 300)):
        frame = DataFrame.from_bytes(rows[i].tobytes(), stream_config(idcode, "bus", 60, 60))
        assert (frame.prefix.soc, frame.prefix.fracsec) == (EPOCH_S + 1, 16_667)
        (pmu,) = frame.pmus
        # positive sequence, line-to-neutral; each part is rounded to 24 bits
        assert pmu.phasors[0] == pytest.approx(expected_v[i], rel=2.0**-23)
        assert (pmu.f_hz, pmu.rocof_hz_s) == ([59.75, 60.5][i], [-0.25, 0.5][i])
        assert pmu.stat == 0

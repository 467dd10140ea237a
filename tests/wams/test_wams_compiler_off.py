"""The same code as plain Python gives the same bits."""

import hashlib
import os
import subprocess
import sys

import numpy as np

from tieline.units import tick_ns
from tieline.wams import PmuReporter, WideAreaAverage

N_SENSORS, N_CONTROLLERS = 5, 3


def digest() -> str:
    """Return a fingerprint of frames, averages, ages and counts of a few intervals of noise."""
    rng = np.random.default_rng(7)
    idcodes = np.arange(1, N_SENSORS + 1)
    reporter = PmuReporter(idcodes, np.full(N_SENSORS, 500e3), 1_700_000_000)
    average = WideAreaAverage(
        N_CONTROLLERS, idcodes, rng.random(N_SENSORS), 60.0, epoch_s=1_700_000_000
    )
    fingerprint = hashlib.sha256()
    for k in range(12):
        v = np.exp(1j * rng.random(N_SENSORS))
        f_hz, rocof_hz_s = 60.0 + rng.standard_normal((2, N_SENSORS))
        payloads = reporter.frames(tick_ns(k, 60), v, f_hz, rocof_hz_s)
        payloads[k % N_SENSORS, k] ^= 1
        destination = rng.integers(0, N_CONTROLLERS, 8)
        average.deliver(payloads, destination, rng.integers(0, N_SENSORS, 8))
        ages_s = average.age_s(tick_ns(k + 1, 60))
        for values in (payloads, average.wbar_pu, ages_s, *average.counts.values()):
            fingerprint.update(values.tobytes())
    return fingerprint.hexdigest()


def test_frames_and_averages_are_the_same_without_the_compiler() -> None:
    """Otherwise compiled and uncompiled runs of one experiment differ, and none can be trusted."""
    script = f"import runpy; print(runpy.run_path({__file__!r})['digest']())"
    plain = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "TIELINE_COMPILER": "off"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert plain.stdout.strip() == digest()

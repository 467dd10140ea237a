"""The stabilisers of IEEE Std 421.5: special cases of one another, and what zeros switch off."""

from collections.abc import Mapping

import numpy as np
import pytest

from conformance.examples import evaluate, signals
from grid.stabiliser_runs import gain, respond, swing, vector
from tieline.grid.models.pss import pss2c
from tieline.grid.models.pss.delta_omega import DeltaOmega
from tieline.grid.models.pss.pss1a import PSS1A
from tieline.grid.models.pss.pss2c import PSS2C
from tieline.grid.models.pss.pss4c import BANDS, PSS4C, band_at

FREQUENCIES_HZ = (0.02, 0.1, 0.7, 2.0, 8.0)
WIDE = {"VSTmax": 10.0, "VSTmin": -10.0}


def powerless(values: Mapping[str, float]) -> dict[str, float]:
    """Return the PSS2C that has only the speed branch of a PSS1A without signal conditioning."""
    speed = {"KS1": values["KS"], "Tw1": values["T5"], "T6": values["T6"], "Tw2": 0.0}
    off = {"KS2": 0.0, "KS3": 0.0, "T8": 0.0, "T9": 0.0, "T10": 0.0, "T11": 0.0}
    off |= {"T12": 0.0, "T13": 0.0, "PPSSon": -100.0, "PPSSoff": -100.0}
    shared = {name: values[name] for name in ("T1", "T2", "T3", "T4", "VSTmax", "VSTmin")}
    return {**PSS2C.example, **speed, **off, **shared}


def test_pss1a_without_transducer_and_conditioning_is_the_delta_omega_stabiliser() -> None:
    """The plain stabiliser of the cases is a PSS1A; a table may name it either way."""
    plain = DeltaOmega.example
    values = {**PSS1A.example, "KS": plain["K"], "T5": plain["Tw"], "T6": 0.0, "A1": 0.0, "A2": 0.0}
    values |= {name: plain[name] for name in ("T1", "T2", "T3", "T4")}
    values |= {"VSTmax": plain["vsmax"], "VSTmin": plain["vsmin"]}
    for f_hz in FREQUENCIES_HZ:
        assert gain(PSS1A, values, "omega", f_hz) == pytest.approx(
            gain(DeltaOmega, plain, "omega", f_hz), rel=1e-12
        )
    np.testing.assert_array_equal(
        respond(PSS1A, values, swing, 3.0), respond(DeltaOmega, plain, swing, 3.0)
    )


@pytest.mark.parametrize("T6", [0.0, 0.01])
def test_pss2c_with_its_power_branch_off_is_the_corresponding_pss1a(T6: float) -> None:
    """The dual-input stabiliser must not do anything of its own to the speed."""
    values = {**PSS1A.example, "A1": 0.0, "A2": 0.0, "T6": T6}
    dual = powerless(values)
    for f_hz in FREQUENCIES_HZ:
        assert gain(PSS2C, dual, "omega", f_hz) == pytest.approx(
            gain(PSS1A, values, "omega", f_hz), rel=1e-12
        )
        assert gain(PSS2C, dual, "Pe", f_hz) == 0.0
    # Transducer and washout stand in the other order: equal up to 1e-16 times a gain of 500, and
    # up to what the Runge-Kutta method makes of the order, which is nothing for linear blocks.
    np.testing.assert_allclose(
        respond(PSS2C, dual, swing, 3.0), respond(PSS1A, values, swing, 3.0), rtol=0, atol=1e-12
    )


def test_pss2b_and_pss2a_are_what_zeros_leave_of_pss2c() -> None:
    """Old data sheets give the predecessors; their transfer functions are published."""
    s = 2j * np.pi * 0.7
    p = {**PSS2C.example, "T10": 0.4, "T11": 0.1, "PPSSon": -100.0, "PPSSoff": -100.0}
    wash = [s * p[f"Tw{k}"] / (1 + s * p[f"Tw{k}"]) for k in (1, 2, 3)]
    ramp = (1 + s * p["T8"]) / (1 + s * p["T9"]) ** 5
    stages = p["KS1"] * (1 + s * p["T1"]) / (1 + s * p["T2"])
    stages *= (1 + s * p["T3"]) / (1 + s * p["T4"])
    power = wash[2] * p["KS2"] / (1 + s * p["T7"])
    third = (1 + s * p["T10"]) / (1 + s * p["T11"])
    for values, last in ((p, third), (p | {"T10": 0.0, "T11": 0.0}, 1.0)):
        of_speed, of_power = (gain(PSS2C, values, name, 0.7) for name in ("omega", "Pe"))
        assert of_speed == pytest.approx(stages * last * wash[0] * wash[1] * ramp, rel=1e-12)
        assert of_power == pytest.approx(stages * last * power * (ramp - 1), rel=1e-12)


@pytest.mark.parametrize(("M", "N"), [(5, 1), (1, 1), (2, 4), (4, 2), (8, 1), (3, 0)])
def test_the_ramp_tracking_filter_has_the_order_that_is_asked_for(M: int, N: int) -> None:
    """Its lags are the whole protection from torsional oscillations."""
    values = {**PSS2C.example, **WIDE, "M": float(M), "N": float(N), "KS2": 0.0, "KS3": 0.0}
    s, step = 2j * np.pi * 1.3, 1e-3
    ramp = ((1 + s * values["T8"]) / (1 + s * values["T9"]) ** M) ** N
    without = gain(PSS2C, values | {"N": 0.0}, "omega", 1.3)
    assert gain(PSS2C, values, "omega", 1.3) == pytest.approx(without * ramp, rel=1e-12)
    output = respond(
        PSS2C, values, lambda t: {"omega": 1 + step * np.sin(2 * np.pi * 1.3 * t)}, 20.0
    )
    # 20 s are ten washout time constants: exp(-10) of the start is left; the peak of a sine
    # sampled 185 times a period is found to 2e-4.
    assert np.ptp(output[-1000:]) / (2 * step) == pytest.approx(abs(without * ramp), rel=5e-4)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"M": 2.5}, "whole M and N"),
        ({"M": 5.0, "N": 2.0}, "N M <= 8 (got M = 5, N = 2)"),
        ({"T10": 0.3}, "needs T11 > 0 s beside T10 = 0.3 s"),
        ({"T9": 0.0}, "needs T9 > 0 s beside T8 = 0.5 s"),
        ({"PPSSoff": 0.5}, "needs PPSSoff <= PPSSon (got 0.5 and 0.1)"),
        ({"VSI2min": 3.0}, "needs VSI2min <= VSI2max"),
    ],
)
def test_pss2c_refuses_what_contradicts_itself(changed: dict[str, float], words: str) -> None:
    """Each value may be fine on its own."""
    (finding,) = PSS2C.check({**PSS2C.example, **changed})
    assert words in finding


def test_the_output_of_pss2c_heeds_the_power_with_hysteresis() -> None:
    """A stabiliser of a unit at little load is out of service, and must not flutter at the edge."""
    values = {**PSS2C.example, "PPSSon": 0.3, "PPSSoff": 0.2, "KS2": 0.0}
    at = (0.0, 1.0, 2.0, 3.0, 4.0, 9.0)
    powers = (0.35, 0.25, 0.15, 0.25, 0.35)
    is_on = (True, True, False, False, True)

    def signal(t: float) -> dict[str, float]:
        power = powers[int(np.searchsorted(at, t + 1e-9) - 1)]
        return {"omega": 1.0 + 1e-3 * np.sin(3.0 * t), "Pe": power}

    v_s = respond(PSS2C, values, signal, 5.0)
    for start, expected in zip(at, is_on, strict=False):
        # The switch takes 14 ms; look from 0.1 s after each change on.
        part = v_s[round((start + 0.1) * 240) : round((start + 1.0) * 240)]
        assert bool(np.abs(part).max() > 0) is expected


@pytest.mark.parametrize(("power", "is_on"), [(0.25, 1.0), (0.15, 0.0), (0.5, 1.0)])
def test_the_switch_starts_open_only_below_its_lower_threshold(power: float, is_on: float) -> None:
    """The history before the start is not known; stabilisers are usually in service."""
    p = vector(PSS2C, {**PSS2C.example, "PPSSon": 0.3, "PPSSoff": 0.2})
    x = PSS2C.initialise(signals(1) | {"Pe": np.array([power])}, p)
    assert x[pss2c.X.is_on, 0] == is_on


def test_the_limits_of_pss2c_clip_inputs_and_output() -> None:
    """A limit on the wrong side of a washout would let a step through."""
    values = {**PSS2C.example, "VSI1max": 0.01, "VSI1min": -0.01, "PPSSon": -100, "PPSSoff": -100}
    p = vector(PSS2C, values)
    named = signals(1)
    x = PSS2C.initialise(named, p)
    derivatives = [
        evaluate(PSS2C, x, named | {"omega": np.array([omega])}, p)[0] for omega in (1.01, 1.2)
    ]
    np.testing.assert_allclose(derivatives[0], derivatives[1], rtol=0, atol=1e-12)
    v_s = respond(PSS2C, {**PSS2C.example}, lambda t: {"omega": 1 + 0.05 * np.sin(4 * t)}, 3.0)
    assert v_s.max() == PSS2C.example["VSTmax"]
    assert v_s.min() == PSS2C.example["VSTmin"]


@pytest.mark.parametrize("band", ["VL", "L", "I"])
def test_pss4c_with_one_band_and_one_branch_is_its_lead_lag_chain(band: str) -> None:
    """The bands add; one alone must be nothing but its blocks."""
    values = {**PSS4C.example, **WIDE, **{f"K{other}": 0.0 for other in BANDS}}
    chain = {"1": 0.5, "2": 0.06, "3": 0.3, "4": 0.05, "5": 0.2, "6": 0.04}
    values |= {f"T{band}{number}": value for number, value in chain.items()}
    values |= {f"K{band}": 3.0, f"K{band}1": 2.0, f"K{band}2": 0.0, f"K{band}11": 0.7}
    values |= {f"V{band}max": 10.0, f"V{band}min": -10.0}
    s = 2j * np.pi * 0.7
    transducer = (1 - 1.759e-3 * s) / (1 + 1.7823e-2 * s + 1.2739e-4 * s * s)
    expected = 3.0 * 2.0 * (0.7 + 0.5 * s) / (1 + 0.06 * s)
    expected *= (1 + 0.3 * s) / (1 + 0.05 * s) * (1 + 0.2 * s) / (1 + 0.04 * s)
    assert gain(PSS4C, values, "omega", 0.7) == pytest.approx(expected * transducer, rel=1e-12)
    assert gain(PSS4C, values, "Pe", 0.7) == 0.0


def test_pss4c_with_one_band_responds_as_the_chain_of_pss1a() -> None:
    """The same numbers in a model that shares no line of the bands' equations."""
    values = {**PSS4C.example, **WIDE, **{f"K{other}": 0.0 for other in BANDS}}
    numbers = {"TI1": 0.3, "TI2": 0.03, "TI3": 0.2, "TI4": 0.05, "KI": 5.0, "KI1": 1.0, "KI2": 0.0}
    values |= numbers | {"VImax": 10.0, "VImin": -10.0}
    # A washout of 1e9 s passes everything, and the conditioning is the transducer's denominator;
    # its numerator 1 - 1.759e-3 s is the difference that is left, 1.759e-3 times the derivative.
    chain = {**PSS1A.example, **WIDE, "KS": 5.0, "T1": 0.3, "T2": 0.03, "T3": 0.2, "T4": 0.05}
    chain |= {"T5": 1e9, "T6": 0.0, "A1": 1.7823e-2, "A2": 1.2739e-4}
    plain = respond(PSS1A, chain, swing, 3.0)
    expected = plain - 1.759e-3 * np.gradient(plain, 1 / 240)
    got = respond(PSS4C, values, swing, 3.0)
    # Central differences at 1/240 s of what moves at 2.2 rad/s; the start, a corner of the speed,
    # is left out.
    np.testing.assert_allclose(got[240:], expected[240:], rtol=0, atol=1e-6)
    assert np.abs(expected).max() > 1e-3


def test_pss4b_is_pss4c_without_the_very_low_band() -> None:
    """Three bands on the same transducers: old data sheets stay usable."""
    values = {**PSS4C.example, "KVL": 0.0}
    s = 2j * np.pi * 0.05
    transducer = (1 - 1.759e-3 * s) / (1 + 1.7823e-2 * s + 1.2739e-4 * s * s)
    expected = transducer * sum(band_at(s, values, band) for band in ("L", "I"))
    assert gain(PSS4C, values, "omega", 0.05) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("band", "f_hz", "K"), [("VL", 0.01, 0.5), ("L", 0.07, 7.5), ("I", 0.7, 30.0), ("H", 8, 120.0)]
)
def test_each_band_of_the_example_peaks_where_it_is_tuned(band: str, f_hz: float, K: float) -> None:
    """66 and 1.2 are numbers of the standard; they mean gain KX and phase zero at the centre."""
    peak = band_at(2j * np.pi * f_hz, PSS4C.example, band)
    assert peak == pytest.approx(K, rel=1e-9)
    for factor in (0.7, 1.4):
        assert abs(band_at(2j * np.pi * f_hz * factor, PSS4C.example, band)) < K


def test_the_examples_numbers_are_the_published_ones() -> None:
    """The simplified rule has to give back the rounded figures of the data sheet."""
    published = {
        "KL1": 66, "TL1": 1.73, "TL2": 2.075, "TL7": 2.075, "TL8": 2.491, "TI1": 0.173,
        "TI2": 0.2075, "TI8": 0.2491, "TH1": 0.01513, "TH2": 0.01816, "TH8": 0.02179,
    }  # fmt: skip
    for symbol, value in published.items():
        # Printed with four digits, of which the last is rounded.
        assert PSS4C.example[symbol] == pytest.approx(value, rel=4e-4), symbol


def test_the_high_band_hears_the_integral_of_power_as_a_speed() -> None:
    """-Pe / (2 H s) is the speed while mechanical power stands still; 421.5-2005 lost the sign."""
    s = 2j * np.pi * 3.0
    declared = gain(PSS4C, PSS4C.example, "Pe", 3.0)
    as_speed = band_at(s, PSS4C.example, "H") * -1 / (2 * PSS4C.example["H"] * s)
    # Washouts of 1 s and a lag of 1/80 s are what separates them at 3 Hz.
    assert declared == pytest.approx(as_speed * s**2 / (1 + s) ** 2 / (1 + s / 80), rel=1e-12)
    assert abs(np.angle(declared / as_speed, deg=True)) < 10


def test_a_notch_of_pss4c_stops_its_frequency_in_its_path_alone() -> None:
    """The standard's answer to torsional modes that a transducer passes."""
    values = {**PSS4C.example, "wnL1": 2 * np.pi * 16.0, "BwL1": 10.0}
    assert abs(gain(PSS4C, values, "omega", 16.0)) < 1e-9 * abs(
        gain(PSS4C, PSS4C.example, "omega", 16.0)
    )
    assert gain(PSS4C, values, "Pe", 16.0) == gain(PSS4C, PSS4C.example, "Pe", 16.0)


def test_each_band_and_the_sum_of_pss4c_are_limited() -> None:
    """A slow frequency excursion may use up the low band's limit, not the whole output."""
    values = {**PSS4C.example, "KVL": 0.0, "KI": 0.0, "KH": 0.0}
    low = respond(PSS4C, values, lambda t: {"omega": 1.0 - 0.05 * np.sin(0.4 * t)}, 12.0)
    assert low.min() == -values["VLmax"]
    assert low.max() == values["VLmax"]
    both = respond(PSS4C, PSS4C.example, lambda t: {"omega": 1.0 - 0.1 * np.sin(4 * t)}, 3.0)
    assert both.min() == -values["VSTmax"]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"TL3": 0.2}, "needs TL4 > 0 s beside TL3 = 0.2 s"),
        ({"TH2": 0.0}, "needs TH2 > 0 s beside TH1"),
        ({"wnH2": 90.0}, "needs wnH2 and BwH2 both > 0, or both 0 (got 90, 0)"),
    ],
)
def test_pss4c_refuses_what_contradicts_itself(changed: dict[str, float], words: str) -> None:
    """Each value may be fine on its own."""
    (finding,) = PSS4C.check({**PSS4C.example, **changed})
    assert words in finding


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"T1": 0.3, "T2": 0.0}, "needs T2 > 0 s beside T1 = 0.3 s"),
        ({"A1": 0.0}, "needs A1 > 0 s beside A2 = 0.0017 s2"),
    ],
)
def test_pss1a_refuses_what_contradicts_itself(changed: dict[str, float], words: str) -> None:
    """Each value may be fine on its own."""
    (finding,) = PSS1A.check({**PSS1A.example, **changed})
    assert words in finding

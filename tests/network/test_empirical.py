"""Delays from distributions and from measured ones: their distribution, order, losses and files."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tieline.errors import CosimError, InputError
from tieline.network.empirical import EmpiricalDelay
from tieline.network.engine import LOSS, Outcome
from tieline.network.ideal import ConstantDelay
from tieline.network.path_delays import DrawnDelay, MeasuredDelay, path_delays, read_trace
from tieline.network.settings import EmpiricalSettings
from tieline.network.spec import direct_spec

SOURCES = [{"name": f"pmu{i}", "bus": 10 + i} for i in range(2)]
DESTINATIONS = [{"name": f"ctl{j}", "unit": f"G{j}", "bus": 20 + j} for j in range(3)]
PATHS = 6
GAP_NS = 16_666_667


def engine_of(delays, loss: float = 0.0, keeps_order: bool = True, seed: int = 1) -> EmpiricalDelay:
    """Return an engine with these delays of each path."""
    spec = direct_spec(SOURCES, DESTINATIONS, min(delay.least_ns for delay in delays))
    return EmpiricalDelay(spec, delays, loss, keeps_order, seed)


def measured(*delays_ms: float, is_in_turn: bool = True) -> MeasuredDelay:
    return MeasuredDelay((np.array(delays_ms) * 1_000_000).astype(np.int64), is_in_turn)


def carried(engine: EmpiricalDelay, frames: int, step: int = 1) -> Outcome:
    """Return what became of frames from both sources, asked for every few of them."""
    outcomes = []
    for k in range(frames):
        engine.send(k * GAP_NS, np.arange(2), k)
        if k % step == 0:
            outcomes.append(engine.run_until(k * GAP_NS))
    outcomes.append(engine.run_until(frames * GAP_NS + 20 * 10**9))
    parts = zip(*((o.arrivals, o.drops) for o in outcomes), strict=True)
    return Outcome(*(np.concatenate(part) for part in parts))


def delays_ns(outcome: Outcome) -> np.ndarray:
    return outcome.arrivals["arrival_ns"] - outcome.arrivals["sequence"].astype(np.int64) * GAP_NS


def test_a_single_delay_is_the_constant_engine() -> None:
    """Otherwise two engines would deliver one and the same network differently."""
    one = carried(engine_of([measured(250)] * PATHS), 40)
    other = carried(ConstantDelay(3, 250_000_000), 40)
    assert one.arrivals.tobytes() == other.arrivals.tobytes()


def test_measured_delays_in_turn_are_played_back() -> None:
    """Otherwise a recorded spell of long delays would be torn apart."""
    samples = (30, 10, 20, 40, 15)
    outcome = carried(engine_of([measured(*samples)] * PATHS, keeps_order=False), 600)
    own = outcome.arrivals[
        (outcome.arrivals["source"] == 1) & (outcome.arrivals["destination"] == 2)
    ]
    own = own[np.argsort(own["sequence"])]
    played = own["arrival_ns"] - own["sequence"].astype(np.int64) * GAP_NS
    assert played.tolist() == [1_000_000 * samples[k % 5] for k in range(600)]


def test_measured_delays_at_random_keep_their_distribution() -> None:
    """Otherwise the engine would be another network than the one that was measured.

    Chi-square over four samples, one of which stands twice; 6,000 packets.
    """
    delay = measured(20, 30, 40, 40, 55, is_in_turn=False)
    found = delays_ns(carried(engine_of([delay] * PATHS, keeps_order=False), 1_000))
    counts = np.array([np.count_nonzero(found == 1_000_000 * ms) for ms in (20, 30, 40, 55)])
    assert counts.sum() == 6_000
    assert stats.chisquare(counts, np.array([1, 1, 2, 1]) * 1_200).pvalue > 1e-4


def test_a_distribution_is_drawn_from_with_its_offset() -> None:
    """Otherwise a gamma with 80 ms would be reported where another one was simulated."""
    settings = EmpiricalSettings.model_validate(
        {
            "distribution": {"distribution": "gamma", "mean": "20 ms", "deviation": "10 ms"},
            "offset": "60 ms",
            "paths": [
                {
                    "source": 11,
                    "destination": "G2",
                    "distribution": {"distribution": "uniform", "low": 0, "high": "1 ms"},
                }
            ],
        }
    )
    delays = path_delays(settings, SOURCES, DESTINATIONS)
    outcome = carried(engine_of(delays, keeps_order=False), 1_000)
    is_own = (outcome.arrivals["source"] == 1) & (outcome.arrivals["destination"] == 2)
    found = delays_ns(outcome)
    assert found[is_own].max() <= 1_000_000
    gamma = stats.gamma(4, loc=0.06, scale=0.005)
    assert stats.kstest(found[~is_own] / 1e9, gamma.cdf).pvalue > 1e-4


def test_order_is_kept_or_not_as_told() -> None:
    """Otherwise a path that cannot re-order, such as TCP, could not be described."""
    delay = measured(50, 5, 5, 5)
    kept = carried(engine_of([delay] * PATHS), 4)
    own = kept.arrivals[(kept.arrivals["source"] == 0) & (kept.arrivals["destination"] == 0)]
    assert own["sequence"].tolist() == [0, 1, 2, 3]
    assert own["arrival_ns"].tolist() == [50_000_000] * 3 + [3 * GAP_NS + 5_000_000]
    free = carried(engine_of([delay] * PATHS, keeps_order=False), 4)
    own = free.arrivals[(free.arrivals["source"] == 0) & (free.arrivals["destination"] == 0)]
    assert own["sequence"].tolist() == [1, 2, 0, 3]


def test_losses_have_their_probability_and_every_packet_is_accounted_for() -> None:
    """Otherwise packets would vanish, or be lost more often than was asked for."""
    engine = engine_of([measured(40)] * PATHS, loss=0.1)
    outcome = carried(engine, 1_000)
    counts = engine.counts()
    assert (counts.sent, counts.in_flight) == (6_000, 0)
    assert counts.delivered == len(outcome.arrivals)
    assert counts.dropped_loss == len(outcome.drops) == 6_000 - len(outcome.arrivals)
    assert stats.binomtest(len(outcome.drops), 6_000, 0.1).pvalue > 1e-4
    assert set(outcome.drops["reason"].tolist()) == {LOSS}
    late = outcome.drops["dropped_ns"] - outcome.drops["sequence"].astype(np.int64) * GAP_NS
    assert set(late.tolist()) == {40_000_000}
    assert np.all(np.diff(outcome.drops["dropped_ns"]) >= 0)


def test_neither_cadence_nor_other_paths_change_a_path() -> None:
    """Otherwise a run would depend on how often it is looked at, or on who else is there."""
    delay = DrawnDelay(EmpiricalSettings.model_validate(GAMMA).distribution.jitter(), 0)
    whole, pieces = (carried(engine_of([delay] * PATHS, 0.05), 300, step) for step in (1, 300))
    assert whole.arrivals.tobytes() == pieces.arrivals.tobytes()
    assert whole.drops.tobytes() == pieces.drops.tobytes()
    other = carried(engine_of([delay, *[measured(9)] * (PATHS - 1)], 0.05), 300)
    for one, two in ((whole.arrivals, other.arrivals), (whole.drops, other.drops)):
        first = [rows[(rows["source"] == 0) & (rows["destination"] == 0)] for rows in (one, two)]
        assert first[0].tobytes() == first[1].tobytes()
    reseeded = carried(engine_of([delay] * PATHS, 0.05, seed=2), 300)
    assert reseeded.arrivals.tobytes() != whole.arrivals.tobytes()


GAMMA = {"distribution": {"distribution": "gamma", "mean": 0.05, "deviation": 0.03}}


def test_a_late_frame_is_refused() -> None:
    """Otherwise a packet could arrive in an interval that has been handed over."""
    engine = engine_of([measured(40)] * PATHS)
    engine.run_until(40_000_001)
    with pytest.raises(CosimError, match="came when the network had reached"):
        engine.send(0, np.arange(2), 0)


def test_a_trace_is_read_by_path_and_by_any_name(tmp_path: Path) -> None:
    """Otherwise delays measured on one path would be used on another."""
    rows = [f"{s},{d},{i}e-3" for s in ("pmu0", 11) for i, d in enumerate(("ctl0", "G1", " ctl2 "))]
    path = tmp_path / "delays.csv"
    path.write_text("\n".join(["source,destination,delay_s", *rows, "pmu0,G0,0.5", ""]))
    found = [delays_ns.tolist() for delays_ns in read_trace(path, SOURCES, DESTINATIONS)]
    assert found == [[0, 500_000_000], [1_000_000], [2_000_000], [0], [1_000_000], [2_000_000]]
    path.write_text("delay_s\n0.25\n0.123456789\n")
    for delays_ns in read_trace(path, SOURCES, DESTINATIONS):
        assert delays_ns.tolist() == [250_000_000, 123_456_789]


BAD_TRACES = [
    ("", ["delays.csv:1: the columns must be 'delay_s' or 'source,destination,delay_s'"]),
    ("delay\n1\n", ["delays.csv:1:", "(got 'delay')"]),
    ("delay_s\n", ["there is no delay in it"]),
    (
        "delay_s\n0.1\nsoon\n-1\n0.1,2\n",
        [":3:", "'soon'", ":4:", "0 to 10 s (got -1)", ":5: a row"],
    ),
    ("delay_s\nnan\n", [":2: delay_s must be 0 to 10 s (got nan)"]),
    (
        "source,destination,delay_s\npmu7,G1,1\npmu0,H9,1\n",
        [":2: unknown source 'pmu7'", "did you mean 'pmu", ":3: unknown destination 'H9'"],
    ),
    ("source,destination,delay_s\npmu0,G0,1\n", ["of the path from pmu0 to ctl1 and 4 more paths"]),
]


@pytest.mark.parametrize(("text", "words"), BAD_TRACES)
def test_a_faulty_trace_is_refused_with_its_line(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    """Otherwise a mistyped delay would quietly shape a result."""
    path = tmp_path / "delays.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_trace(path, SOURCES, DESTINATIONS)
    for word in words:
        assert word in str(caught.value)


def test_a_missing_trace_is_refused(tmp_path: Path) -> None:
    """Otherwise the user would see a traceback."""
    with pytest.raises(InputError, match=r"no\.csv cannot be read"):
        read_trace(tmp_path / "no.csv", SOURCES, DESTINATIONS)


def test_an_unknown_path_is_refused() -> None:
    """Otherwise a path would keep the delays of all, unnoticed."""
    path = {"source": "pmu9", "destination": "G0"} | GAMMA
    settings = EmpiricalSettings.model_validate(GAMMA | {"paths": [path]})
    with pytest.raises(InputError, match=r"empirical\.paths\[0\]: unknown source 'pmu9'"):
        path_delays(settings, SOURCES, DESTINATIONS)

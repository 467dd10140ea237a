"""Condenses a run to the numbers of its closing table; reads result folders only."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.columns import Columns
from tieline.experiment.results import Run
from tieline.experiment.ringdown import ring_down

SETTLING_S = 5.0
"""The settling value is the mean over this long at the end of a run that lasts four times as long
after its event, and over the last tenth of a shorter one."""

RING_DOWN_BEGINS_S = 2.0
"""After the last event: the first swings, which are not linear, are left out."""

RING_DOWN_LASTS_S = 15.0
RING_DOWN_RATE_HZ = 20.0
"""Samples a second for the estimator: an order of magnitude above the swings."""

DEFAULT_BAND_HZ = (0.2, 0.8)


def summarise(run: Run) -> dict[str, Any]:
    """Return the summary of a run: plain numbers, None where there is nothing to tell.

    Raises:
        InputError: the run's files cannot be read.
    """
    with run.kept_open():
        return _summary(run)


def _summary(run: Run) -> dict[str, Any]:
    # Never all of its columns at once: those of a long run take more memory than the run itself.
    grid = run.values("grid", "t_s", "coi_pu")
    told = run.told()
    return {
        "label": run.label,
        "ending": run.ending(),
        "frequency": _frequency(run, grid, float(told["frequency_hz"])),
        "swing": _swing(run, grid, told.get("tie_mode")),
        "delay": _delay(run),
        "packets": _packets(run.values("flows")),
        "age": _age(run),
        "lowest_voltage": _lowest_voltage(run),
        "times": run.manifest.get("times", {}),
    }


def _frequency(run: Run, grid: Columns, nominal_hz: float) -> dict[str, Any]:
    """Nadir after the first event and settling value of the centre-of-inertia frequency."""
    time_s, frequency_hz = _values(grid, "t_s"), nominal_hz * _values(grid, "coi_pu")
    # The ending of a run without a future is logged last; nothing is recorded from it on.
    events = run.events()[:-1] if run.ending() is not None else run.events()
    start_s = min(min((at for at, _ in events), default=time_s[0]), time_s[-1])
    after = np.flatnonzero(time_s >= start_s)
    nadir = after[np.argmin(frequency_hz[after])]
    span_s = time_s[-1] - start_s
    window_s = SETTLING_S if span_s >= 4 * SETTLING_S else span_s / 10
    last = frequency_hz[time_s >= time_s[-1] - window_s]
    return {
        "nadir_hz": float(frequency_hz[nadir]),
        "nadir_s": float(time_s[nadir]),
        "settling_hz": float(np.mean(last)),
        "settling_window_s": float(window_s),
        "settling_spread_hz": float(np.ptp(last)),
    }


def _swing(run: Run, grid: Columns, tie_mode: Mapping[str, Any] | None) -> dict[str, Any]:
    """Ring-down of the tie mode: one group of units against another, after the last event."""
    if tie_mode is None:
        return _no_swing("the case names no tie mode")
    band_hz = tuple(tie_mode.get("band_Hz", DEFAULT_BAND_HZ))
    groups = {"units": list(tie_mode["units"]), "against": list(tie_mode["against"])}
    lost = run.tripped_units() & {*groups["units"], *groups["against"]}
    known = set(run.columns("grid"))
    missing = [u for group in groups.values() for u in group if f"speed_pu.{u}" not in known]
    if lost or missing:
        return _no_swing(f"no speed of {', '.join(sorted(lost) or missing)} to compare with")
    time_s = _values(grid, "t_s")
    begin_s = max((at for at, _ in run.events()), default=time_s[0]) + RING_DOWN_BEGINS_S
    end_s = min(begin_s + RING_DOWN_LASTS_S, time_s[-1])
    window = np.flatnonzero((time_s >= begin_s) & (time_s <= end_s))
    step_s = float(time_s[1] - time_s[0]) if len(time_s) > 1 else 1.0
    thin = max(1, round(1 / (RING_DOWN_RATE_HZ * step_s)))
    window = window[::thin]
    difference = _mean_speed(run, groups["units"]) - _mean_speed(run, groups["against"])
    found = ring_down(difference[window], thin * step_s, (band_hz[0], band_hz[1]))
    about = {"window_s": [float(begin_s), float(end_s)], "band_hz": list(band_hz), **groups}
    if found.mode is None:
        return _no_swing(found.reason) | about
    mode = found.mode
    return {
        "frequency_hz": mode.frequency_hz,
        "damping_ratio": mode.damping_ratio,
        "amplitude_pu": mode.amplitude,
        "energy_share": mode.energy_share,
        "reason": None,
        **about,
    }


def _no_swing(reason: str | None) -> dict[str, Any]:
    return {"frequency_hz": None, "damping_ratio": None, "reason": reason}


def _mean_speed(run: Run, units: list[str]) -> NDArray[np.float64]:
    names = [f"speed_pu.{unit}" for unit in units]
    blocks = run.blocks("grid", names)
    return np.mean([_values(block, name) for block in blocks for name in block], axis=0)


def _delay(run: Run) -> dict[str, Any]:
    """Combined delay over every delivered packet; the setting where no packets are sent."""
    flows, counts = run.values("flows"), run.values("delays")
    network = run.config["network"]
    if run.config["wams"]["reporting"] == "continuous":
        delay_s = float(network["delay"] or 0.0)
        return dict.fromkeys(("mean_s", "p50_s", "p95_s", "max_s"), delay_s) | {"jitter_s": 0.0}
    delivered = _values(flows, "delivered") if flows else np.zeros(0)
    if not delivered.sum():
        return dict.fromkeys(("mean_s", "p50_s", "p95_s", "max_s", "jitter_s"))
    arrived = delivered > 0
    weights = delivered[arrived]
    jitter_s = np.nan_to_num(_values(flows, "jitter_s"))
    return {
        "mean_s": float(np.average(flows["delay_mean_s"][arrived], weights=weights)),
        "p50_s": _quantile(counts, 0.5),
        "p95_s": _quantile(counts, 0.95),
        "max_s": float(np.nanmax(flows["delay_max_s"][arrived])),
        "jitter_s": float(np.average(jitter_s[arrived], weights=weights)),
    }


def _quantile(counts: Columns, share: float) -> float | None:
    """Return a quantile from the histogram, linear within a bin."""
    if not counts or not counts["count"].sum():
        return None
    heights = _values(counts, "count")
    reached = np.concatenate([[0.0], np.cumsum(heights)]) / heights.sum()
    bin_ = int(np.searchsorted(reached, share, side="left")) - 1
    low, high = _values(counts, "bin_low_s")[bin_], _values(counts, "bin_high_s")[bin_]
    within = (share - reached[bin_]) / (reached[bin_ + 1] - reached[bin_])
    return float(low + within * (high - low))


def _packets(flows: Columns) -> dict[str, Any]:
    names = ("sent", "delivered", "dropped_queue", "dropped_loss", "dropped_down", "in_flight")
    totals = {name: int(flows[name].sum()) if name in flows else 0 for name in names}
    lost = totals["dropped_queue"] + totals["dropped_loss"] + totals["dropped_down"]
    # Packets still under way at the end are neither lost nor delivered.
    ended = lost + totals["delivered"]
    return totals | {"loss": lost / ended if ended else 0.0}


def _age(run: Run) -> dict[str, Any]:
    """Mean age of the data that each controller holds, over the time that it holds any."""
    prefix = "age_s."
    names = [name for name in run.columns("grid") if name.startswith(prefix)]
    means = {
        column.removeprefix(prefix): float(np.nanmean(values))
        for block in run.blocks("grid", names)
        for column, values in block.items()
        if not np.isnan(values).all()
    }
    mean = float(np.mean(list(means.values()))) if means else None
    return {"mean_s": mean, "controllers_s": means}


def _lowest_voltage(run: Run) -> dict[str, Any] | None:
    """The unit in service with the lowest terminal voltage of the run."""
    prefix = "vt_pu."
    lost = {prefix + unit for unit in run.tripped_units()}
    names = [name for name in run.columns("grid") if name.startswith(prefix) and name not in lost]
    if not names:
        return None
    lowest = {
        name: float(np.fmin.reduce(values))
        for block in run.blocks("grid", names)
        for name, values in block.items()
    }
    column = min(lowest, key=lambda name: lowest[name])
    of_it = run.values("grid", "t_s", column)
    row = int(np.nanargmin(_values(of_it, column)))
    return {
        "unit": column.removeprefix(prefix),
        "vt_pu": lowest[column],
        "t_s": float(_values(of_it, "t_s")[row]),
    }


def _values(table: Columns, column: str) -> NDArray[np.float64]:
    return table[column].astype(np.float64)

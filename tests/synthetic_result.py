"""Makes result folders like a run's from formulas, so that readers are tested without a run."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tieline.cosim.interfaces import GRID, NETWORK
from tieline.experiment.launch import Outcome
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import Plan, prepare
from tieline.experiment.sites import Sites
from tieline.experiment.supervise import ProcessUse
from tieline.experiment.watch import Progress
from tieline.tables import Column, write_table

UNITS = ("G21", "G26", "G34")
SITES = Sites(
    sensors=(2, 61, 119),
    controllers=(("G21", 48), ("G34", 118)),
    frequency_hz=60.0,
    tie_mode={"units": ["G34"], "against": ["G21"], "band_Hz": [0.2, 0.8]},
)
SWING_HZ, DAMPING_RATIO = 0.35, 0.12
NADIR_PU, SETTLING_PU = 0.996, 0.997
EXPERIMENT = """\
# A question?
name: tiny
question: Does it hold?
case: miniwecc
grid:
  duration: 41 s
  events: [{at: 1 s, trip_generator: G26}]
"""
CONSTANT = ("network.engine=constant", "network.delay=250 ms")
SWEEP = """\
sweep:
  - {label: ideal, network.engine: ideal, wams.reporting: continuous}
  - {label: 0.25 s, network.engine: constant, network.delay: 250 ms}
"""


def known_sites(*_: object) -> Sites:
    """Answer for case and network as if both had been checked."""
    return SITES


def plan_of(folder: Path, text: str = EXPERIMENT, settings: Sequence[str] = ()) -> Plan:
    """Return the plan of an experiment's text, with no case or network looked at.

    Without a sweep, the engine is the one with a constant delay: it needs no topology.
    """
    path = folder / "tiny.yaml"
    path.write_text(text, encoding="utf-8")
    options = [*settings, *(() if "sweep" in text else CONSTANT)]
    return prepare(load_experiment(str(path), options), known_sites)


def write_grid(folder: Path, duration_s: float = 41.0, delay_s: float = 0.0) -> None:
    """Write grid.parquet: a dip to the nadir, a swing of G34 against G21, G26 running away."""
    t = np.arange(0.0, duration_s + 1e-9, 1 / 60)
    after = np.clip(t - 1.0, 0.0, None)
    # The dip's lowest point is where tau * exp(1 - tau) = 1: three seconds after the event.
    tau = after / 3.0
    dip = tau * np.exp(1 - tau)
    coi = 1 - (1 - SETTLING_PU) * (1 - np.exp(-after)) - (SETTLING_PU - NADIR_PU) * dip
    w = 2 * np.pi * SWING_HZ
    decay = w * DAMPING_RATIO / np.sqrt(1 - DAMPING_RATIO**2)
    swing = 1e-3 * np.exp(-decay * after) * np.sin(w * after)
    speeds = {"G21": coi - swing / 2, "G26": 1 + 0.04 * after, "G34": coi + swing / 2}
    late = np.interp(t - delay_s, t, coi)
    data: dict[str, Any] = {"t_s": t, "coi_pu": coi}
    for unit in UNITS:
        data[f"speed_pu.{unit}"] = speeds[unit]
        data[f"vt_pu.{unit}"] = 1.02 - (0.05 if unit == "G34" else 0.02) * dip
    for unit, _ in SITES.controllers:
        data[f"wbar_pu.{unit}"] = late
        data[f"age_s.{unit}"] = np.where(t < delay_s, np.nan, delay_s)
    columns = [
        Column(name, name.split(".")[0].rsplit("_")[-1], f"synthetic {name}") for name in data
    ]
    write_table(folder / "grid.parquet", columns, data)
    log = {"t_s": [1.0], "what": np.array(["G26 trips"], dtype=object), "is_ending": [0]}
    columns = [
        Column("t_s", "s", "instant"),
        Column("what", "", "event", "str"),
        Column("is_ending", "", "1 if the run ended with it", "int64"),
    ]
    write_table(folder / "events.parquet", columns, {k: np.asarray(v) for k, v in log.items()})


def write_network(folder: Path, mean_s: float = 0.25) -> None:
    """Write flows.parquet and delays.parquet: 3 sensors to 2 controllers, 10 ms wide delays."""
    count = len(SITES.sensors) * len(SITES.controllers)
    sent, lost = np.full(count, 1000), np.full(count, 10)
    flows: dict[str, tuple[str, Any]] = {
        "flow": ("int64", np.arange(count)),
        "source": ("str", np.array([f"pmu{i % 3:02d}" for i in range(count)], dtype=object)),
        "destination": ("str", np.array([f"ctl{i // 3:02d}" for i in range(count)], dtype=object)),
        "sent": ("int64", sent),
        "delivered": ("int64", sent - lost - 5),
        "dropped_queue": ("int64", lost // 2),
        "dropped_loss": ("int64", lost - lost // 2),
        "in_flight": ("int64", np.full(count, 5)),
        "delay_mean_s": ("float64", np.full(count, mean_s)),
        "delay_max_s": ("float64", np.full(count, mean_s + 0.01)),
        "jitter_s": ("float64", np.full(count, 0.002)),
    }
    columns = [Column(name, "", f"synthetic {name}", kind) for name, (kind, _) in flows.items()]
    write_table(folder / "flows.parquet", columns, {name: v for name, (_, v) in flows.items()})
    edges = mean_s - 0.01 + 0.001 * np.arange(21)
    heights = np.round(1000 * np.exp(-(((edges[:-1] + 0.0005 - mean_s) / 0.004) ** 2))).astype(int)
    write_table(
        folder / "delays.parquet",
        [
            Column("bin_low_s", "s", "lower edge"),
            Column("bin_high_s", "s", "upper edge"),
            Column("count", "", "frames", "int64"),
        ],
        {"bin_low_s": edges[:-1], "bin_high_s": edges[1:], "count": heights},
    )


def outcome(granted_s: float) -> Outcome:
    """Return what a launcher would report of a run that got so far."""
    granted_ns = {GRID: int(granted_s * 1e9) + 2000, NETWORK: int(granted_s * 1e9) + 1000}
    use = (ProcessUse(GRID, 0, 1.25, 200_000_000), ProcessUse(NETWORK, 0, 0.5, 100_000_000))
    return Outcome({"start": 0.5, "run": 1.0, "end": 0.25}, granted_ns, use)


def fake_launch(folder: Path, on_progress: Callable[[Progress], None]) -> Outcome:
    """Write the tables that a run would have written, and say how far it has come."""
    told = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    duration_s = told["grid"]["duration"]
    delay_s = told["network"]["delay"] or told["network"]["mean_delay"] or 0.0
    write_grid(folder, duration_s, delay_s)
    if told["wams"]["reporting"] != "continuous":
        write_network(folder, delay_s or 0.1)
    for share in (0.5, 1.0):
        on_progress(Progress(GRID, "running", 1, int(share * duration_s * 1e9)))
    return outcome(duration_s)


def nothing_drawn(folder: Path) -> tuple[Path, list[Path]]:
    """Stand in for what draws: say which page and figures there would be."""
    return folder / "report.html", [folder / "plots" / "overview.png"]

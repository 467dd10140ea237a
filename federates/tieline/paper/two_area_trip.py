"""The two-area system after the loss of G3, with beta1, beta2 and the loads varied."""

import numpy as np
from matplotlib.figure import Figure

from tieline.experiment.results import Run
from tieline.paper.item import Drawn, Found, Item, Spec, Work
from tieline.paper.sources import PSTESS, TWO_AREA
from tieline.paper.statement import Band, Statement
from tieline.paper.trips import (
    RECORDED_HZ,
    Floats,
    expected_folder,
    expected_nadirs,
    from_reference,
    nadir_of,
    trip_figure,
    voltage_of,
)

BETAS = {"beta1": (0.33, 0.67, 1.0), "beta2": (0.0, 0.33, 0.67)}
OTHER = 0.33
UNIT = "G4"
SWING_HZ = 0.76
"""The inter-area mode: its period is averaged away where the large signal is looked at."""

SPEED_PU = 3e-5
"""The reference's corrector smears the event over one step: up to 1.7e-5 pu, its own step 6e-6."""


def shares(quick: bool) -> tuple[float, ...]:
    """Return the shares of constant power in active load."""
    return (0.0, 0.5) if quick else (0.0, 0.25, 0.5, 0.75)


def _spec(quick: bool, beta1: float, beta2: float, share: float = 0.0) -> Spec:
    settings = [
        "sweep=[]",
        f"grid.pss.beta1={beta1:g}",
        f"grid.pss.beta2={beta2:g}",
        f"grid.duration={16 if quick else 21} s",
    ]
    if share:
        settings.append(
            f"grid.loads={{p_constant_power: {share:g}, p_constant_current: {1 - share:g}}}"
        )
    return Spec("two_area_beta1", tuple(settings))


def _beta1_specs(quick: bool) -> tuple[Spec, ...]:
    return tuple(_spec(quick, value, OTHER) for value in BETAS["beta1"])


def _beta2_specs(quick: bool) -> tuple[Spec, ...]:
    return tuple(_spec(quick, OTHER, value) for value in BETAS["beta2"])


def _load_specs(quick: bool) -> tuple[Spec, ...]:
    ends = BETAS["beta2"][0], BETAS["beta2"][-1]
    return tuple(_spec(quick, OTHER, b, share) for share in shares(quick) for b in ends)


def _slow(run: Run) -> Floats:
    """Return the voltage of G4 averaged over a period of the swing: its large signal."""
    samples = round(RECORDED_HZ / SWING_HZ)
    return np.convolve(voltage_of(run, UNIT), np.ones(samples) / samples, mode="valid")


def _compared(runs: list[Run], names: list[str]) -> dict[str, float]:
    folder = expected_folder("two_area", "g3_trip")
    nadirs = expected_nadirs("two_area", "g3_trip")
    return {
        "speeds": max(
            from_reference(run, folder / f"{name}.parquet")
            for run, name in zip(runs, names, strict=True)
        ),
        "nadirs_mhz": 1e3
        * max(abs(nadir_of(run) - nadirs[n]) for run, n in zip(runs, names, strict=True)),
    }


def _beta1(work: Work) -> Found:
    runs = [work.run(spec) for spec in _beta1_specs(work.quick)]
    others = [work.run(spec) for spec in _beta2_specs(work.quick)]
    by_beta1 = max(np.abs(_slow(run) - _slow(runs[0])).max() for run in runs)
    by_beta2 = np.abs(_slow(others[-1]) - _slow(others[0])).max()
    numbers = {"share": by_beta1 / by_beta2}
    numbers |= _compared(runs, [f"rotors_{b:g}_{OTHER:g}" for b in BETAS["beta1"]])
    labels = {f"beta1 = {b:g}": run for b, run in zip(BETAS["beta1"], runs, strict=True)}
    caption = (
        "Loss of G3 at 1 s, K = 18, beta2 = 0.33, average of the rotors. beta1 damps the swing of "
        "the voltage and leaves its course."
    )
    return Found(numbers, {"g3_trip_beta1": Drawn(trip_figure(labels, UNIT, ""), caption)})


def _beta2(work: Work) -> Found:
    runs = [work.run(spec) for spec in _beta2_specs(work.quick)]
    nadirs = [nadir_of(run) for run in runs]
    lowest = [voltage_of(run, UNIT).min() for run in runs]
    numbers = {
        "first_rise_mhz": 1e3 * (nadirs[1] - nadirs[0]),
        "rises": (nadirs[2] - nadirs[1]) / (nadirs[1] - nadirs[0]),
        "lowest_step": float(np.diff(lowest).max()),
    }
    numbers |= _compared(runs, [f"rotors_{OTHER:g}_{b:g}" for b in BETAS["beta2"]])
    labels = {f"beta2 = {b:g}": run for b, run in zip(BETAS["beta2"], runs, strict=True)}
    caption = (
        "Loss of G3 at 1 s, K = 18, beta1 = 0.33, average of the rotors. beta2 lifts the nadir and "
        "pays for it with terminal voltage, and so with load."
    )
    return Found(numbers, {"g3_trip_beta2": Drawn(trip_figure(labels, UNIT, ""), caption)})


def _loads(work: Work) -> Found:
    runs = {spec: work.run(spec) for spec in _load_specs(work.quick)}
    specs, used = list(runs), shares(work.quick)
    benefits = np.array(
        [nadir_of(runs[specs[2 * i + 1]]) - nadir_of(runs[specs[2 * i]]) for i in range(len(used))]
    )
    numbers = {
        "largest_step_mhz": 1e3 * float(np.diff(benefits).max()),
    }
    figure = Figure(figsize=(6.3, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(100 * np.array(used), 1e3 * benefits, "o-", color="C0")
    axes.set_xlabel("active load of constant power, % (the rest constant current)")
    axes.set_ylabel("nadir gained by beta2, mHz")
    axes.set_ylim(bottom=0)
    caption = "Nadir with beta2 = 0.67 minus nadir with beta2 = 0 after the loss of G3."
    return Found(numbers, {"g3_trip_loads": Drawn(figure, caption)})


def _agreement(prefix: str) -> tuple[Statement, ...]:
    return (
        Statement(
            f"{prefix}-speeds", "speeds of G1, G2 and G4 along the three runs", PSTESS, "speeds",
            "0 pu apart", Band(high=SPEED_PU),
            "the other program smears the trip over one of its steps", unit="pu", digits=".1e",
        ),
        Statement(
            f"{prefix}-nadirs", "nadirs of the three runs", PSTESS, "nadirs_mhz", "0 mHz apart",
            Band(high=1e3 * 60.0 * SPEED_PU), "the bound on speeds, as a frequency", unit="mHz",
        ),
    )  # fmt: skip


BETA1 = Item(
    "two_area_trip_beta1",
    "Two areas: loss of G3 with beta1 varied",
    "speed and terminal voltage after the loss of G3 for three beta1",
    "K = 18, beta2 = 0.33, beta1 = 0.33, 0.67, 1; average of the rotors",
    (
        Statement(
            "ta-trip-b1", "beta1 leaves the large-signal terminal voltage of G4 unchanged",
            TWO_AREA, "share", "unchanged", Band(high=0.1),
            "mean over a period of the swing: a tenth of what beta2 moves it",
        ),
        *_agreement("ta-trip-b1"),
    ),
    _beta1,
    lambda quick: (*_beta1_specs(quick), *_beta2_specs(quick)),
)  # fmt: skip

BETA2 = Item(
    "two_area_trip_beta2",
    "Two areas: loss of G3 with beta2 varied",
    "speed and terminal voltage after the loss of G3 for three beta2",
    "K = 18, beta1 = 0.33, beta2 = 0, 0.33, 0.67; average of the rotors",
    (
        Statement(
            "ta-trip-b2-first", "the nadir rises significantly as beta2 goes from 0 to 0.33",
            TWO_AREA, "first_rise_mhz", "significantly", Band(low=100.0),
            "a tenth of a hertz is what a load-shedding stage is apart", unit="mHz", digits=".0f",
        ),
        Statement(
            "ta-trip-b2-second", "the nadir rises modestly from 0.33 to 0.67: in parts of the "
            "first rise",
            TWO_AREA, "rises", "modestly", Band(0.0, 0.5), "less than half of the first rise",
        ),
        Statement(
            "ta-trip-b2-voltage", "the terminal voltage of G4 falls as beta2 rises", TWO_AREA,
            "lowest_step", "falls", Band(high=-1e-3),
            "the lowest voltage must fall with each beta2", unit="pu", digits=".4f",
        ),
        *_agreement("ta-trip-b2"),
    ),
    _beta2,
    _beta2_specs,
)  # fmt: skip

LOADS = Item(
    "two_area_loads",
    "Two areas: what constant-power load leaves of beta2's gain",
    "the nadir with and without beta2 as the share of constant-power load grows",
    "nadirs with beta2 = 0 and 0.67 for several shares; on which system the paper shows it is not "
    "known here",
    (
        Statement(
            "ta-loads", "what beta2 gains in nadir shrinks as load of constant power grows",
            TWO_AREA, "largest_step_mhz", "shrinks", Band(high=-1.0),
            "each larger share must take 1 mHz at least", unit="mHz", digits=".1f",
        ),
    ),
    _loads,
    _load_specs,
)  # fmt: skip

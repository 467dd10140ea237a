"""The miniWECC after the loss of G26: both tunings and the standard one under growing delay."""

from tieline.experiment.results import Run
from tieline.paper.item import Drawn, Found, Item, Spec, Work
from tieline.paper.sources import ABSTRACT, DESIGN, PSTESS, REFERENCE, TRIP
from tieline.paper.statement import Band, Statement
from tieline.paper.trips import (
    NOMINAL_HZ,
    damping_of,
    expected_folder,
    expected_nadirs,
    far_apart,
    frequency_of,
    from_reference,
    nadir_of,
    speeds_of,
    time_of,
    trip_figure,
)

UNIT = "G23"
"""Of the units that stay, the one whose terminal voltage moves most."""

IDEAL = ("network.engine=ideal", "wams.reporting=continuous")
BETA1_FIRST, BETA2_FIRST, EQUAL = (1.0, 0.5), (0.5, 1.0), (1.0, 1.0)
LATEST_S = 1.25
SPEED_PU = 3e-5
"""What the other program's exciter and its smeared event make (cases/miniwecc/expected)."""

MIDDLE_S = (14.0, 19.0)
"""When the swings that the loss itself raised have decayed."""

NADIR_MHZ = 1.0
"""Frames are held for half a reporting interval on average, which a pure delay is not: 8 ms more
delay move the nadir by some 0.1 mHz."""


def delays(quick: bool) -> tuple[float, ...]:
    """Return the mean combined delays, s, in ascending order."""
    return (LATEST_S,) if quick else (0.1, 0.25, 0.5, 1.0, LATEST_S)


def spec(quick: bool, betas: tuple[float, float], delay_s: float) -> Spec:
    """Return the run of a tuning under a mean combined delay, 0 for ideal communication.

    Packets carry the average; the short form has a pure delay instead, as the author's toolbox.
    """
    settings = ["sweep=[]", f"grid.pss.beta1={betas[0]:g}", f"grid.pss.beta2={betas[1]:g}"]
    if quick:
        settings.append("grid.duration=18 s")
    if not delay_s:
        settings += IDEAL
    elif quick:
        settings += [
            "network.engine=constant", f"network.delay={delay_s:g} s", "wams.reporting=continuous"
        ]  # fmt: skip
    else:
        settings.append(f"network.mean_delay={1000 * delay_s:g} ms")
    return Spec("g26_trip", tuple(settings))


def _without(quick: bool, model: str) -> Spec:
    # Growth without stabilisers shows late.
    shorter = (f"grid.duration={18 if model == 'standard' else 31} s",) if quick else ()
    tuning = "{model: standard, gain: 9}" if model == "standard" else f"{{model: {model}}}"
    return Spec("g26_trip", ("sweep=[]", f"grid.pss={tuning}", *shorter, *IDEAL))


def _late_specs(betas: tuple[float, float], quick: bool) -> dict[str, Spec]:
    return {
        "ideal": spec(quick, betas, 0.0),
        **{f"{delay:g} s": spec(quick, betas, delay) for delay in delays(quick)},
    }


def _beta1_specs(quick: bool) -> tuple[Spec, ...]:
    return tuple(_late_specs(BETA1_FIRST, quick).values())


def _beta2_specs(quick: bool) -> tuple[Spec, ...]:
    return tuple(_late_specs(BETA2_FIRST, quick).values())


def _standard_specs(quick: bool) -> tuple[Spec, ...]:
    return (
        _without(quick, "standard"),
        spec(quick, EQUAL, LATEST_S),
        _without(quick, "none"),
        spec(quick, BETA1_FIRST, 0.0),
        spec(quick, BETA2_FIRST, 0.0),
    )


def _beside_reference(runs: dict[str, Run], tuning: str) -> dict[str, float]:
    """Return how far runs lie from the author's toolbox: speeds without delay, nadirs with."""
    folder, nadirs = (
        expected_folder("miniwecc", "g26_trip"),
        expected_nadirs("miniwecc", "g26_trip"),
    )
    apart = [
        abs(nadir_of(run) - nadirs[name])
        for label, run in runs.items()
        if (name := f"sensors_{tuning}_{'0s' if label == 'ideal' else label.replace(' ', '')}")
        in nadirs
    ]
    return {
        "speeds": from_reference(runs["ideal"], folder / f"sensors_{tuning}_0s.parquet"),
        "nadirs_mhz": 1e3 * max(apart),
    }


def _under_delay(
    work: Work, betas: tuple[float, float], tuning: str
) -> tuple[dict[str, float], dict[str, Run]]:
    runs = {label: work.run(of) for label, of in _late_specs(betas, work.quick).items()}
    ideal = runs["ideal"]
    late = [run for label, run in runs.items() if label != "ideal"]
    numbers = {
        "nadir_moves_mhz": 1e3 * max(abs(nadir_of(run) - nadir_of(ideal)) for run in late),
        "damping_moves": max(abs(damping_of(run) - damping_of(ideal)) for run in late),
    }
    return numbers | _beside_reference(runs, tuning), runs


def _beta1(work: Work) -> Found:
    numbers, runs = _under_delay(work, BETA1_FIRST, "1_0.5")
    caption = (
        "(beta1, beta2) = (1, 0.5), K = 9, loss of G26 at 1 s. A late average moves "
        "the nadir by some mHz and delays the recovery; the swing decays as before."
    )
    figure = trip_figure(runs, UNIT, "mean combined delay")
    return Found(numbers, {"g26_delay": Drawn(figure, caption)})


def _beta2(work: Work) -> Found:
    numbers, runs = _under_delay(work, BETA2_FIRST, "0.5_1")
    caption = (
        "(beta1, beta2) = (0.5, 1), K = 9, loss of G26 at 1 s. The nadir stays; the later the "
        "average, the larger the swing after it."
    )
    figure = trip_figure(runs, UNIT, "mean combined delay")
    return Found(numbers, {"g26_delay_exchanged": Drawn(figure, caption)})


def _growth(run: Run) -> float:
    """Return the largest swing of a unit at the end of a run, in parts of that in `MIDDLE_S`."""
    time_s = time_of(run)
    against = speeds_of(run) - frequency_of(run)[:, None] / NOMINAL_HZ
    middle = (time_s >= MIDDLE_S[0]) & (time_s < MIDDLE_S[1])
    last = time_s >= time_s[-1] - (MIDDLE_S[1] - MIDDLE_S[0])
    late, early = (float(against[window].std(axis=0).max()) for window in (last, middle))
    return late / early


def _standard(work: Work) -> Found:
    standard, equal, none, beta1, beta2 = (work.run(of) for of in _standard_specs(work.quick))
    numbers = {
        "apart": far_apart(standard, equal),
        "speeds": from_reference(
            standard, expected_folder("miniwecc", "g26_trip") / "standard.parquet"
        ),
        "none_nadir_hz": nadir_of(none),
        "none_growth": _growth(none),
        "lift_mhz": 1e3 * (nadir_of(beta2) - nadir_of(beta1)),
        "damping_gain": damping_of(beta1) - damping_of(beta2),
    }
    runs = {"no stabiliser": none, "(1, 0.5)": beta1, "(0.5, 1)": beta2, "standard": standard}
    caption = (
        "Loss of G26 at 1 s, ideal communication, K = 9. Without stabilisers the swings grow; "
        "beta2 lifts the nadir, beta1 damps the swing."
    )
    figure = trip_figure(runs, UNIT, "(beta1, beta2)")
    return Found(numbers, {"g26_tunings": Drawn(figure, caption)})


def _beside(prefix: str, tuning: str) -> tuple[Statement, ...]:
    return (
        Statement(
            f"{prefix}-speeds", f"speeds of 33 units, {tuning}, ideal communication", PSTESS,
            "speeds", "0 pu apart", Band(high=SPEED_PU),
            "the other program's exciter and its smeared event", unit="pu", digits=".1e",
        ),
        Statement(
            f"{prefix}-nadirs", f"nadirs, {tuning}, for each delay that both have", PSTESS,
            "nadirs_mhz", "0 mHz apart", Band(high=NADIR_MHZ),
            "frames are held until the next: 8 ms more delay than a pure one", unit="mHz",
            digits=".2f",
        ),
    )  # fmt: skip


BETA1 = Item(
    "g26_delay",
    "miniWECC: loss of G26 under delay, (1, 0.5)",
    "system frequency and terminal voltage after the loss of G26 for several delays",
    "K = 9, beta1 = 1, beta2 = 0.5; ideal communication and packets with mean combined delays to "
    "1.25 s (in the short form pure delays)",
    (
        Statement(
            "g26-nadir", "delays up to 1.25 s do not change the nadir", TRIP, "nadir_moves_mhz",
            "less than 30 mHz", Band(high=30.0), "as the notes bound it", unit="mHz", digits=".1f",
        ),
        Statement(
            "g26-damping", "delays up to 1.25 s leave the damping ratio of the inter-area swing "
            "where it was", TRIP,
            "damping_moves", "no change", Band(high=0.02),
            "the trajectories of the author's toolbox, read by the same estimator, move by 0.016",
        ),
        *_beside("g26", "(1, 0.5)"),
    ),
    _beta1,
    _beta1_specs,
)  # fmt: skip

BETA2 = Item(
    "g26_delay_exchanged",
    "miniWECC: loss of G26 under delay, (0.5, 1)",
    "system frequency and terminal voltage after the loss of G26 for several delays",
    "K = 9, beta1 = 0.5, beta2 = 1; as before",
    _beside("g26-exchanged", "(0.5, 1)"),
    _beta2,
    _beta2_specs,
)

TUNINGS = Item(
    "g26_tunings",
    "miniWECC: loss of G26 with each tuning",
    "the same loss with no stabiliser, the standard one and both tunings of the generalised one",
    "K = 9, ideal communication; the standard stabiliser beside (1, 1) under a delay of 1.25 s",
    (
        Statement(
            "g26-trade-nadir", "the weights trade transient against small-signal response: beta2 "
            "above beta1 lifts the nadir", ABSTRACT, "lift_mhz", "higher", Band(low=10.0),
            "10 mHz are seen in the figure", unit="mHz", digits=".1f",
        ),
        Statement(
            "g26-trade-damping", "and beta1 above beta2 damps the inter-area swing better",
            ABSTRACT, "damping_gain", "higher", Band(low=0.02),
            "beyond the estimator's own spread of 0.01",
        ),
        Statement(
            "g26-equal", "beta1 = beta2 is the standard stabiliser, immune to delay", DESIGN,
            "apart", "0 pu apart", Band(high=1e-12), "rounding; the speeds of 33 units", unit="pu",
            digits=".1e",
        ),
        Statement(
            "g26-standard-speeds", "speeds of 33 units, standard stabiliser", PSTESS, "speeds",
            "0 pu apart", Band(high=SPEED_PU), "the other program's exciter and its smeared event",
            unit="pu", digits=".1e",
        ),
        Statement(
            "g26-none-growth", "without stabilisers the swings grow after the loss", REFERENCE,
            "none_growth", "grow", Band(low=1.0),
            "largest swing of a unit against the centre of inertia in the last 5 s of the run, in "
            "parts of that from 14 to 19 s",
        ),
        Statement(
            "g26-none-nadir", "the nadir without stabilisers", PSTESS, "none_nadir_hz", "59.539 Hz",
            Band(59.536, 59.542), "half of the last digit and the other program's exciter",
            unit="Hz",
        ),
    ),
    _standard,
    _standard_specs,
)  # fmt: skip

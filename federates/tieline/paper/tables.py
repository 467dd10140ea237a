"""The paper's two tables: what each choice of weights is for, and the equivalent forms."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tieline.linear import Modes, linear, modes
from tieline.paper.item import Drawn, Found, Item, Spec, Work
from tieline.paper.sources import DESIGN
from tieline.paper.statement import Band, Statement
from tieline.paper.trips import far_apart, frequency_of, time_of
from tieline.paper.two_area_modes import BETWEEN, LOCAL, SLOW, plain

GAIN = 9.0
FORMS = (
    "generalized",
    "generalized_constant_reference",
    "generalized_synchronous_reference",
)
ROUNDING = 1e-8
"""Relative: an eigenvalue of this size of matrix is good for about 1e-9."""


def _least_damping(found: Modes) -> float:
    return float(found.damping_ratio[found.of_kind(BETWEEN)].min())


def _slow_damping(found: Modes) -> float:
    """Return the damping ratio of frequency regulation, 1 where it no longer oscillates."""
    places = found.of_kind(SLOW)
    return float(found.damping_ratio[places].min()) if len(places) else 1.0


def _apart(one: Modes, both: float) -> float:
    """Return the largest relative distance of a swing of one system from those of equal weights."""
    others = np.linalg.eigvals(
        np.asarray(linear("miniwecc", gain=GAIN, beta1=both, beta2=both).A, np.complex128)
    )
    swings = one.eigenvalues[one.of_kind(SLOW, BETWEEN, LOCAL)]
    return float(max(np.abs(others - swing).min() / abs(swing) for swing in swings))


def _tunings(work: Work) -> Found:
    beta1, beta2 = (
        modes("miniwecc", gain=GAIN, beta1=one, beta2=other)
        for one, other in ((1.0, 0.5), (0.5, 1.0))
    )
    standard, none = modes("miniwecc", pss="standard", gain=GAIN), plain("miniwecc")
    numbers = {
        "between": _least_damping(beta1) - _least_damping(beta2),
        "slow": _slow_damping(beta2) - _slow_damping(beta1),
        "equal": _apart(standard, 1.0),
        "neither": _apart(none, 0.0),
    }
    systems = {"none": none, "(1, 0.5)": beta1, "(0.5, 1)": beta2, "standard": standard}
    figure = _bars({label: (_least_damping(m), _slow_damping(m)) for label, m in systems.items()})
    caption = (
        "Average of 30 PMUs, no delay, K = 9. A damping ratio of 1 says that the mode no longer "
        "oscillates."
    )
    return Found(numbers, {"tunings": Drawn(figure, caption)})


def _bars(ratios: dict[str, tuple[float, float]]) -> Figure:
    figure = Figure(figsize=(6.3, 2.8), layout="constrained")
    panels = figure.subplots(1, 2)
    places: NDArray[np.int64] = np.arange(len(ratios))
    names = ("least damped inter-area mode", "frequency regulation")
    for column, (axes, name) in enumerate(zip(panels, names, strict=True)):
        values = [pair[column] for pair in ratios.values()]
        bars = axes.bar(places, values, color=f"C{column}", width=0.6)
        axes.bar_label(bars, fmt="%.3f", fontsize=7)
        axes.set_xticks(places, list(ratios), fontsize=7)
        axes.set_title(name)
        axes.grid(axis="x", visible=False)
    panels[0].set_ylabel("damping ratio")
    return figure


def _form_specs(quick: bool) -> tuple[Spec, ...]:
    common = (
        "sweep=[]",
        "grid.duration=10 s",
        "network.engine=constant",
        "network.delay=500 ms",
    )
    return tuple(Spec("g26_trip", (*common, f"grid.pss.model={form}")) for form in FORMS)


def _forms(work: Work) -> Found:
    runs = [work.run(spec) for spec in _form_specs(work.quick)]
    numbers = {
        "constant": far_apart(runs[0], runs[1]),
        "synchronous": far_apart(runs[0], runs[2]),
    }
    figure = Figure(figsize=(6.3, 3.0), layout="constrained")
    axes = figure.subplots()
    looks = ({"lw": 4, "color": "0.8"}, {"lw": 2, "color": "C0"}, {"ls": "--", "color": "C1"})
    labels = ("difference form", "constant reference", "reference of synchronous speed")
    for run, look, label in zip(runs, looks, labels, strict=True):
        axes.plot(time_of(run), frequency_of(run), label=label, **look)  # type: ignore[arg-type]
    axes.set_xlabel("time, s")
    axes.set_ylabel("system frequency, Hz")
    axes.ticklabel_format(useOffset=False)
    axes.margins(x=0)
    axes.legend()
    caption = "Loss of G26 with (1, 0.5) and an average that is 0.5 s late: three curves in one."
    return Found(numbers, {"forms": Drawn(figure, caption)})


TUNINGS = Item(
    "table_tunings",
    "Table: what each choice of weights is for",
    "the choices of beta1 and beta2 and what each targets; which of the paper's tables it is, is "
    "not confirmed",
    "modes of the miniWECC, K = 9, for each choice",
    (
        Statement(
            "tab-b1", "beta1 > beta2 targets inter-area and local modes: least damping ratio of "
            "the inter-area modes above that of beta1 < beta2", DESIGN, "between", "higher",
            Band(low=0.01), "1 % of damping counts",
        ),
        Statement(
            "tab-b2", "beta1 < beta2 targets the frequency-regulation mode: its damping ratio "
            "above that of beta1 > beta2", DESIGN, "slow", "higher", Band(low=0.01),
            "1 % of damping counts",
        ),
        Statement(
            "tab-equal", "beta1 = beta2 is the standard delta-omega stabiliser: its swings", DESIGN,
            "equal", "0 apart", Band(high=ROUNDING), "rounding of eigenvalues", digits=".1e",
        ),
        Statement(
            "tab-neither", "beta1 = beta2 = 0 is no stabiliser: its swings", DESIGN, "neither",
            "0 apart", Band(high=ROUNDING), "rounding of eigenvalues", digits=".1e",
        ),
    ),
    _tunings,
)  # fmt: skip

FORMS_TABLE = Item(
    "table_forms",
    "Table: the equivalent forms of the controller",
    "the control error with a constant reference and with the reference of synchronous speed; "
    "which of the paper's tables it is, is not confirmed",
    "loss of G26, (1, 0.5), K = 9, an average 0.5 s late, 10 s, with each form",
    (
        Statement(
            "tab-constant", "the form with a constant reference gives the same output", DESIGN,
            "constant", "0 pu apart", Band(high=1e-9), "rounding; speeds of 33 units", unit="pu",
            digits=".1e",
        ),
        Statement(
            "tab-synchronous", "the form with the reference of synchronous speed gives it, too",
            DESIGN, "synchronous", "0 pu apart", Band(high=1e-9), "rounding; speeds of 33 units",
            unit="pu", digits=".1e",
        ),
    ),
    _forms,
    _form_specs,
)  # fmt: skip

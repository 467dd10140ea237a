"""The time-varying damping coefficient, on which the paper's argument rests, along a trajectory."""

import numpy as np

from tieline.experiment.results import Run
from tieline.grid.case import load_case
from tieline.linear.damping import damping_coefficients
from tieline.linear.plots import damping_in_time
from tieline.paper.g26_trip import BETA1_FIRST, spec
from tieline.paper.item import Drawn, Found, Item, Work
from tieline.paper.sources import DESIGN
from tieline.paper.statement import Band, Statement
from tieline.paper.trips import EVENT_S, Floats, time_of
from tieline.resources import case_folder

SHOWN_S = 15.0
FROM_S = EVENT_S + 0.5
"""The jump of power at the event is none of a derivative."""


def _by_acceleration(run: Run, unit: str) -> Floats:
    """Return (t - 2,) D(t) from the speed alone, the swing equation solved for (Pm - Pe) / w."""
    case = load_case(case_folder("miniwecc"))
    values = next(d.values for d in case.devices["machine"] if d.unit == unit)
    H, D = values["H"], values.get("D", 0.0)
    w = run.table("grid", f"speed_pu.{unit}")[f"speed_pu.{unit}"].to_numpy(np.float64)
    time_s = time_of(run)
    rate = (w[2:] - w[:-2]) / (time_s[2:] - time_s[:-2])
    return np.asarray(D + (2 * H * rate + D * (w[1:-1] - 1.0)) / w[1:-1])


def _damping(work: Work) -> Found:
    run = work.run(spec(work.quick, BETA1_FIRST, 0.0))
    time_s, curves = damping_coefficients(run.folder)
    inside = time_s[1:-1] >= FROM_S
    apart = []
    for unit, curve in curves.items():
        by_powers, by_speed = curve[1:-1][inside], _by_acceleration(run, unit)[inside]
        apart.append(np.std(by_powers - by_speed) / np.std(by_powers))
    caption = (
        "The five units whose coefficient varies most. Right after the loss units give more than "
        "their turbines do and are damped less, until governors follow."
    )
    shown = time_s <= SHOWN_S
    figures = {
        "damping": Drawn(
            damping_in_time(time_s[shown], {u: D[shown] for u, D in curves.items()}), caption
        )
    }
    return Found({"apart": float(max(apart))}, figures)


DAMPING = Item(
    "damping",
    "The time-varying damping coefficient",
    "what becomes of a unit's damping when its swing equation is linearised about a moving "
    "trajectory; that the paper plots it is not known here",
    "D(t) from the powers along the trip of G26, and from the acceleration of the same units",
    (
        Statement(
            "damping", "along a moving trajectory the damping coefficient is D + (Pm - Pe) / w^2",
            DESIGN, "apart", "equal", Band(high=0.02),
            "root-mean-square difference from the coefficient that the units' acceleration gives; "
            "differences over 1/30 s blur a swing of 1.5 Hz by 0.4 %",
        ),
    ),
    _damping,
    lambda quick: (spec(quick, BETA1_FIRST, 0.0),),
)  # fmt: skip

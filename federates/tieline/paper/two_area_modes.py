"""The two-area system: its modes without stabilisers, and its root loci over beta1 and beta2."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from tieline.linear import Modes, Study, Sweep, modes, sweep
from tieline.linear.modes import Kind
from tieline.linear.plots import root_locus
from tieline.paper.item import Drawn, Found, Item, Work
from tieline.paper.shapes import mode_shapes
from tieline.paper.sources import LINEAR, REFERENCE
from tieline.paper.statement import Band, Statement, about

BETWEEN: Kind = "inter-area"
SLOW: Kind = "frequency regulation"
LOCAL: Kind = "local"
GAIN = 25.0
"""K of the root loci, pu."""

STAYS = Band(high=0.02)
"""Part of its distance from the origin by which a mode may move and still count as left alone."""

STAYS_WHY = (
    "2 % of the mode's distance to the origin; what a weight does move goes some tens of per cent"
)

BY_CONSTRUCTION = (
    "met by construction: reactances, inertia and droop of this case were chosen so that it is; "
    "the author's published parameters give {original:.3f} Hz"
)
LAG = "the average of PMU frequencies comes through a derivative filter, whose lag the rotors lack"


FINE, COARSE = 21, 6
"""Points of a sweep. On the two-area system with PMUs fewer than 21 lead from frequency regulation,
where it meets the real axis, to another mode."""


@cache
def plain(case: str) -> Modes:
    """Return the modes of a case without stabilisers."""
    return modes(case, pss="none")


@cache
def locus(case: str, weight: str, average: str, points: int = FINE) -> Sweep:
    """Return the root locus of one weight, the other at 0."""
    other = "beta2" if weight == "beta1" else "beta1"
    study = Study(case, gain=GAIN, average=average, **{other: 0.0})  # type: ignore[arg-type]
    return sweep(study, weight, np.linspace(0.0, 1.0, points).tolist())


def farthest(found: Sweep, *kinds: str) -> float:
    """Return how far the modes of some kinds move at most, in parts of where they began."""
    moves = [
        np.abs(track.eigenvalues - track.eigenvalues[0]).max() / abs(track.eigenvalues[0])
        for place, track in zip(found.places, found.tracks, strict=True)
        if found.start.kinds[place] in kinds
    ]
    return float(max(moves))


def least_step_left(found: Sweep, *kinds: str) -> float:
    """Return the largest change of a real part over a step of the sweep, 1/s: negative is left."""
    steps = [
        np.diff(track.eigenvalues.real).max()
        for place, track in zip(found.places, found.tracks, strict=True)
        if found.start.kinds[place] in kinds
    ]
    return float(max(steps))


def most_rise(found: Sweep, kind: str) -> float:
    """Return by how much the frequency of modes of a kind rises at most, in parts of the first."""
    return max(
        float(track.frequency_hz.max() / track.frequency_hz[0]) - 1.0
        for place, track in zip(found.places, found.tracks, strict=True)
        if found.start.kinds[place] == kind
    )


def growing_others(case: str, average: str) -> NDArray[np.complex128]:
    """Return the modes other than inter-area ones that grow with beta2 = 1 alone, 1/s."""
    at = modes(case, gain=GAIN, beta1=0.0, beta2=1.0, average=average)
    kinds = np.array(at.kinds)
    grows = (at.eigenvalues.real > 1e-6) & (kinds != BETWEEN) & (at.eigenvalues.imag > 0)
    return at.eigenvalues[grows]


def _plain(work: Work) -> Found:
    found, original = (plain(case) for case in ("two_area", "two_area_original"))
    slow, between = (found.of_kind(kind)[0] for kind in (SLOW, BETWEEN))
    shape = found.shapes[:, slow]
    numbers = {
        "between_hz": found.frequency_hz[between],
        "between_damping": found.damping_ratio[between],
        "between_apart": _apart_deg(found, int(between)),
        "slow_hz": found.frequency_hz[slow],
        "slow_uneven": float(np.abs(shape - 1.0).max()),
        "original_between_hz": original.frequency_hz[original.of_kind(BETWEEN)[0]],
        "original_slow_hz": original.frequency_hz[original.of_kind(SLOW)[0]],
    }
    places = found.of_kind(SLOW, BETWEEN, LOCAL).tolist()
    caption = (
        "Rotor speeds in each mode, the largest drawn as 1. All four units move together in the "
        "first; in the second the areas swing against each other. In the last two the small unit "
        "of each area swings against its large one; their frequencies all but coincide, so that "
        "both areas show in both."
    )
    return Found(numbers, {"two_area_shapes": Drawn(mode_shapes(found, places), caption)})


def _apart_deg(found: Modes, place: int) -> float:
    """Return the least angle between a unit of one area and one of the other, degrees."""
    angle = np.angle(found.shapes[:, place])
    apart = [np.angle(np.exp(1j * (angle[i] - angle[j])), deg=True) for i in (0, 1) for j in (2, 3)]
    return float(np.abs(apart).min())


def _beta1(work: Work) -> Found:
    rotors, sensors = (locus("two_area", "beta1", of) for of in ("rotor", "sensor"))
    slow = sensors.track_of(SLOW).frequency_hz
    numbers = {
        "between_step": least_step_left(rotors, BETWEEN),
        "local_step": least_step_left(rotors, LOCAL),
        "slow_move": farthest(rotors, SLOW),
        "slow_move_sensors": farthest(sensors, SLOW),
        "slow_first_hz": slow[0],
        "slow_last_hz": slow[-1],
        "local_rise": most_rise(rotors, LOCAL),
    }
    caption = (
        f"K = {GAIN:g}, beta2 = 0, average of the rotor speeds. The inter-area mode (circles) and "
        "the local ones (triangles) go left as beta1 grows; the frequency-regulation mode (square) "
        "stays. A marks modes that wander at least a third as far as the farthest."
    )
    return Found(numbers, {"two_area_beta1": Drawn(root_locus(rotors), caption)})


def _beta2(work: Work) -> Found:
    rotors, sensors = (locus("two_area", "beta2", of) for of in ("rotor", "sensor"))
    others = {of: growing_others("two_area", of) for of in ("rotor", "sensor")}
    numbers = {
        "slow_damping": rotors.track_of(SLOW).damping_ratio[-1],
        "slow_damping_sensors": sensors.track_of(SLOW).damping_ratio[-1],
        "between_move": farthest(rotors, BETWEEN),
        "growing": float(len(others["rotor"])),
        "growing_sensors": float(len(others["sensor"])),
    }
    if len(others["sensor"]):
        numbers["growing_hz"] = others["sensor"][0].imag / (2 * np.pi)
    caption = (
        f"K = {GAIN:g}, beta1 = 0, average of the rotor speeds. The frequency-regulation mode "
        "(squares) meets the real axis and parts; the slower real eigenvalue is drawn from there. "
        "The inter-area mode stays right of the axis: beta2 alone does not damp it."
    )
    return Found(numbers, {"two_area_beta2": Drawn(root_locus(rotors), caption)})


PLAIN = Item(
    "two_area_modes",
    "Two areas: modes without stabilisers",
    "the modes of the two-area system and their shapes",
    "eigenvalues and rotor-speed shapes of the linearised system, no stabiliser in service",
    (
        Statement(
            "ta-between-hz", "the inter-area mode is at 0.76 Hz", LINEAR, "between_hz", "0.76 Hz",
            about(0.76, 0.005), "half of the last digit given",
            against=BY_CONSTRUCTION.replace("original", "original_between_hz"), unit="Hz",
        ),
        Statement(
            "ta-between-unstable", "the inter-area mode is unstable", LINEAR, "between_damping",
            "damping ratio below 0", Band(high=-1e-9), "its sign is stated",
        ),
        Statement(
            "ta-between-shape", "in the inter-area mode G1 and G2 swing against G3 and G4",
            LINEAR, "between_apart",
            "in opposition", about(180, 25), "within 25 degrees of opposition", unit="degrees",
            digits=".1f",
        ),
        Statement(
            "ta-slow-hz", "the frequency-regulation mode is at 0.09 Hz", LINEAR, "slow_hz",
            "0.09 Hz", about(0.09, 0.005), "half of the last digit given",
            against=BY_CONSTRUCTION.replace("original", "original_slow_hz"), unit="Hz",
        ),
        Statement(
            "ta-slow-shape", "in the frequency-regulation mode all speeds are in phase and nearly "
            "equal", LINEAR,
            "slow_uneven", "nearly equal", Band(high=0.1),
            "largest complex difference from the largest speed, a tenth of it", digits=".1e",
        ),
    ),
    _plain,
)  # fmt: skip

BETA1 = Item(
    "two_area_beta1",
    "Two areas: root locus of beta1",
    "the poles of the two-area system as beta1 goes from 0 to 1",
    f"modes followed from beta1 = 0 to 1, K = {GAIN:g}, beta2 = 0",
    (
        Statement(
            "ta-b1-between", "beta1 moves the inter-area mode to the left", LINEAR, "between_step",
            "left", Band(high=-1e-6), "every step of the sweep must go left", unit="1/s",
        ),
        Statement(
            "ta-b1-local", "beta1 moves the local modes to the left", LINEAR, "local_step", "left",
            Band(high=-1e-6), "every step of the sweep must go left", unit="1/s",
        ),
        Statement(
            "ta-b1-slow", "beta1 leaves the frequency-regulation mode where it is (average of the "
            "rotor speeds)", LINEAR, "slow_move", "does not move", STAYS, STAYS_WHY, digits=".1e",
        ),
        Statement(
            "ta-b1-slow-pmu", "beta1 leaves it there (average of PMU frequencies)", LINEAR,
            "slow_move_sensors", "does not move", STAYS, STAYS_WHY, Band(high=0.2),
            f"{LAG}: the mode goes from {{slow_first_hz:.4f}} to {{slow_last_hz:.4f}} Hz, as in "
            "the author's toolbox; the paper's sweeps imply the average of the rotors",
        ),
        Statement(
            "ta-b1-local-hz", "with beta1 the local modes rise only slightly in frequency",
            REFERENCE,
            "local_rise", "slightly", Band(0.0, 0.1), "up to a tenth is slight",
            difference="the author's toolbox gives the same on these data; "
            "the paper's own data of this system are not published",
        ),
    ),
    _beta1,
)  # fmt: skip

BETA2 = Item(
    "two_area_beta2",
    "Two areas: root locus of beta2",
    "the poles of the two-area system as beta2 goes from 0 to 1",
    f"modes followed from beta2 = 0 to 1, K = {GAIN:g}, beta1 = 0, and the modes that grow at 1",
    (
        Statement(
            "ta-b2-slow", "beta2 damps the frequency-regulation mode until it is over-damped "
            "(average of the rotor speeds)", LINEAR, "slow_damping", "damping ratio 1",
            Band(low=1.0), "a real eigenvalue has the damping ratio 1",
        ),
        Statement(
            "ta-b2-slow-pmu", "beta2 damps it so (average of PMU frequencies)", LINEAR,
            "slow_damping_sensors", "damping ratio 1", Band(low=1.0),
            "a real eigenvalue has the damping ratio 1",
        ),
        Statement(
            "ta-b2-between", "beta2 leaves the inter-area mode where it is", LINEAR,
            "between_move", "does not move", STAYS, STAYS_WHY, digits=".4f",
        ),
        Statement(
            "ta-b2-others", "beta2 makes no other mode grow (average of the rotor speeds)",
            REFERENCE,
            "growing", "0 modes", Band(0, 0), "a count", digits=".0f",
        ),
        Statement(
            "ta-b2-others-pmu", "beta2 makes no other mode grow (average of PMU frequencies)",
            REFERENCE,
            "growing_sensors", "0 modes", Band(0, 0), "a count", Band(1, 1),
            f"{LAG}: with beta2 = 1 a mode at {{growing_hz:.2f}} Hz grows, in the author's "
            "toolbox, too; the paper's sweeps imply the average of the rotors", digits=".0f",
        ),
    ),
    _beta2,
)  # fmt: skip

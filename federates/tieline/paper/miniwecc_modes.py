"""The miniWECC: modes without stabilisers, and root loci over beta1 and beta2."""

import numpy as np

from tieline.linear.plots import root_locus
from tieline.paper.item import Drawn, Found, Item, Work
from tieline.paper.shapes import mode_shapes
from tieline.paper.sources import LINEAR
from tieline.paper.statement import Band, Statement, about
from tieline.paper.two_area_modes import (
    BETWEEN,
    COARSE,
    FINE,
    GAIN,
    LOCAL,
    SLOW,
    STAYS,
    STAYS_WHY,
    farthest,
    least_step_left,
    locus,
    plain,
)

IN_PHASE_DEG = 60.0
SEEN = 0.05
NORTH_SOUTH_HZ = 0.373


def _plain(work: Work) -> Found:
    found = plain("miniwecc")
    slow = found.of_kind(SLOW)[0]
    shape = found.shapes[:, slow]
    seen = np.abs(shape) > SEEN
    angle = np.abs(np.angle(shape * np.conj(shape.mean()), deg=True))
    numbers = {
        "slow_hz": found.frequency_hz[slow],
        "slow_apart": angle[seen].max(),
    }
    places = [int(slow), *(int(k) for k in found.of_kind(BETWEEN)[:5])]
    caption = (
        "Rotor speeds of the 34 units in the frequency-regulation mode and five inter-area modes, "
        "the largest drawn as 1, coloured by the areas of the case; some are named."
    )
    return Found(numbers, {"miniwecc_shapes": Drawn(mode_shapes(found, places), caption)})


def _beta1(work: Work) -> Found:
    found = locus("miniwecc", "beta1", "rotor", COARSE if work.quick else FINE)
    numbers = {
        "between_step": least_step_left(found, BETWEEN),
        "local_step": least_step_left(found, LOCAL),
        "slow_move": farthest(found, SLOW),
    }
    caption = (
        f"K = {GAIN:g}, beta2 = 0, average of the rotor speeds. Every swing goes left as beta1 "
        "grows; the square near the origin, frequency regulation, hardly moves. A marks modes "
        "that wander at least a third as far as the farthest."
    )
    return Found(numbers, {"miniwecc_beta1": Drawn(root_locus(found), caption)})


def _beta2(work: Work) -> Found:
    found = locus("miniwecc", "beta2", "rotor", COARSE if work.quick else FINE)
    numbers = {
        "slow_damping": found.track_of(SLOW).damping_ratio[-1],
        "swing_move": farthest(found, BETWEEN, LOCAL),
    }
    swing = next(
        track
        for place, track in zip(found.places, found.tracks, strict=True)
        if abs(found.start.frequency_hz[place] - NORTH_SOUTH_HZ) < 0.01
    )
    first, last = 100 * swing.damping_ratio[[0, -1]]
    caption = (
        f"K = {GAIN:g}, beta1 = 0, average of the rotor speeds. Frequency regulation (squares) "
        "goes to the real axis and along it. Of the swings none moves far, but the one at "
        f"{NORTH_SOUTH_HZ:g} Hz loses damping: {first:.1f} to {last:.1f} %."
    )
    return Found(numbers, {"miniwecc_beta2": Drawn(root_locus(found), caption)})


PLAIN = Item(
    "miniwecc_modes",
    "miniWECC: modes without stabilisers",
    "the modes of the miniWECC and their shapes",
    "eigenvalues and rotor-speed shapes of the linearised system, no stabiliser in service",
    (
        Statement(
            "mw-slow-hz", "the frequency-regulation mode is near 0.04 Hz", LINEAR, "slow_hz",
            "0.04 Hz", about(0.04, 0.005), "half of the last digit given", unit="Hz", digits=".4f",
        ),
        Statement(
            "mw-slow-shape", "in the frequency-regulation mode all speeds are in phase", LINEAR,
            "slow_apart", "in phase",
            Band(high=IN_PHASE_DEG), "every speed that is seen, within 60 degrees of their mean",
            unit="degrees", digits=".1f",
        ),
    ),
    _plain,
)  # fmt: skip

BETA1 = Item(
    "miniwecc_beta1",
    "miniWECC: root locus of beta1",
    "the poles of the miniWECC as beta1 goes from 0 to 1",
    f"modes followed from beta1 = 0 to 1, K = {GAIN:g}, beta2 = 0, average of the rotor speeds",
    (
        Statement(
            "mw-b1-between", "beta1 moves the inter-area modes to the left", LINEAR,
            "between_step", "left", Band(high=-1e-6), "every step of every mode must go left",
            unit="1/s", digits=".4f",
        ),
        Statement(
            "mw-b1-local", "beta1 moves the local modes to the left", LINEAR, "local_step",
            "left", Band(high=-1e-6),
            "every step of every mode must go left", unit="1/s",
        ),
        Statement(
            "mw-b1-slow", "beta1 leaves the frequency-regulation mode where it is", LINEAR,
            "slow_move", "does not move", STAYS, STAYS_WHY, digits=".4f",
        ),
    ),
    _beta1,
)  # fmt: skip

BETA2 = Item(
    "miniwecc_beta2",
    "miniWECC: root locus of beta2",
    "the poles of the miniWECC as beta2 goes from 0 to 1",
    f"modes followed from beta2 = 0 to 1, K = {GAIN:g}, beta1 = 0, average of the rotor speeds",
    (
        Statement(
            "mw-b2-slow", "beta2 damps the frequency-regulation mode until it is over-damped",
            LINEAR, "slow_damping", "damping ratio 1", Band(low=1.0),
            "a real eigenvalue has the damping ratio 1",
        ),
        Statement(
            "mw-b2-swings", "beta2 leaves inter-area and local modes where they are", LINEAR,
            "swing_move", "do not move", STAYS, STAYS_WHY, digits=".4f",
        ),
    ),
    _beta2,
)  # fmt: skip

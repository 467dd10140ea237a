"""Root loci: the modes of a case while one setting moves, and which modes that setting reaches.

Modes are sorted into groups by how far they wander in the complex plane, as a part of what the
farthest one does: A at least `REACHED`, B at least `TOUCHED`, C the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.grid.settings import LoadSettings
from tieline.grid.system import System
from tieline.grid.tables import near
from tieline.linear.linearise import linearise
from tieline.linear.modes import Modes, modes_of
from tieline.linear.retune import retuned
from tieline.linear.study import Study
from tieline.linear.track import Track, follow

Floats = NDArray[np.float64]

REACHED, TOUCHED = 1.0 / 3.0, 1.0 / 30.0

TUNING = {"gain": "K", "beta1": "beta1", "beta2": "beta2"}
"""Settings that move no operating point, and the parameter of the stabiliser that they are."""

LOADS = ("p_constant_power", "p_constant_current", "p_frequency", "q_frequency")
PARAMETERS = (*TUNING, *LOADS, "inertia")
"""What can be swept: tuning, composition of every load, factor on the inertia constants."""


@dataclass(frozen=True)
class Sweep:
    """The tracks of the oscillating modes of a case along one setting.

    Attributes:
        parameter: its name, one of `PARAMETERS`.
        values: (points,) of it.
        start: the modes at its first value.
        places: places in `start` of the modes that were followed.
        tracks: their tracks, in the same order.
    """

    parameter: str
    values: Floats
    start: Modes
    places: NDArray[np.int64]
    tracks: tuple[Track, ...]

    @property
    def groups(self) -> tuple[str, ...]:
        """Return the group of each track, `A`, `B` or `C`."""
        lengths = np.array([track.length for track in self.tracks])
        share = lengths / lengths.max() if lengths.size and lengths.max() > 0 else lengths
        return tuple("A" if s >= REACHED else "B" if s >= TOUCHED else "C" for s in share)

    def track_of(self, kind: str) -> Track:
        """Return the track of the slowest mode that begins as one of a kind.

        Raises:
            InputError: there is none.
        """
        for place, track in zip(self.places, self.tracks, strict=True):
            if self.start.kinds[place] == kind:
                return track
        kinds = sorted({self.start.kinds[place] for place in self.places})
        raise InputError(f"no mode begins as '{kind}'{near(kind, kinds)}")

    def table(self) -> pd.DataFrame:
        """Return the root locus, a row for each mode and value."""
        parts = []
        for number, (place, track, group) in enumerate(
            zip(self.places, self.tracks, self.groups, strict=True), start=1
        ):
            parts.append(
                pd.DataFrame(
                    {
                        "mode": number,
                        "kind": self.start.kinds[place],
                        "group": group,
                        self.parameter: track.values,
                        "real_1_per_s": track.eigenvalues.real,
                        "imag_rad_per_s": track.eigenvalues.imag,
                        "frequency_Hz": track.frequency_hz,
                        "damping_ratio": track.damping_ratio,
                    }
                )
            )
        return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def sweep(
    study: Study,
    parameter: str,
    values: Sequence[float],
    units: Sequence[str] | None = None,
    mechanical_only: bool = True,
) -> Sweep:
    """Return the root locus of a case along one setting.

    The operating point is solved anew for each value of a setting that moves it.

    Args:
        study: the case and its other settings; its own value of the parameter has no say.
        parameter: one of `PARAMETERS`.
        values: (points,) at least two, ascending or descending.
        units: units whose tuning or inertia moves; None for all of them.
        mechanical_only: leave out modes of exciters and controls.

    Raises:
        InputError: a parameter, value or unit that cannot be.
        NumericalError: a mode could not be followed, or an operating point not be found.
    """
    if parameter not in PARAMETERS:
        raise InputError(f"no sweep over '{parameter}'{near(parameter, PARAMETERS)}")
    steps = np.diff(values)
    if len(values) < 2 or not (np.all(steps > 0) or np.all(steps < 0)):
        raise InputError("a sweep needs at least two values in ascending or descending order")

    @lru_cache(maxsize=1)
    def base() -> System:
        return study.system()

    def modes_at(value: float) -> Modes:
        if parameter in TUNING:
            return modes_of(linearise(retuned(base(), "pss", {TUNING[parameter]: value}, units)))
        return modes_of(linearise(_moved(study, parameter, value, units).system()))

    start = modes_at(values[0])
    places = start.within()
    if mechanical_only:
        places = np.array([k for k in places if start.kinds[k] != "control"], np.int64)
    tracks = follow(modes_at, [float(value) for value in values], places.tolist())
    return Sweep(parameter, np.array(values, np.float64), start, places, tuple(tracks))


def _moved(study: Study, parameter: str, value: float, units: Sequence[str] | None) -> Study:
    if parameter == "inertia":
        return replace(study, inertia=value, inertia_of="all" if units is None else units)
    if units is not None:
        raise InputError(f"{parameter} moves in every load: it takes no units")
    shares = {} if study.loads is None else study.loads.model_dump()
    if parameter.startswith("p_constant"):
        # What the share leaves is constant current where power moves, and impedance otherwise.
        shares |= {"p_constant_power": 0.0, "p_constant_current": 0.0, parameter: value}
        if parameter == "p_constant_power":
            shares["p_constant_current"] = 1.0 - value
    else:
        shares = {"p_constant_current": 1.0, **shares, parameter: value}
    return replace(study, loads=LoadSettings.model_validate(shares))

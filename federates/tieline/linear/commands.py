"""`tieline modes`, `tieline freqresp` and `tieline damping`: linear analysis from the command line.

Each prints a table, or JSON with --json, and writes table and plots to a folder.
"""

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from tieline.errors import InputError, NumericalError
from tieline.experiment.overrides import shortest
from tieline.figures import STYLE, save
from tieline.linear import plots
from tieline.linear.damping import damping_coefficients
from tieline.linear.delay import damping_against_delay, delay_margin, delayed_eigenvalues
from tieline.linear.linearise import linearise
from tieline.linear.modes import BAND_HZ, COLUMNS, Modes, modes_of
from tieline.linear.response import (
    decibel,
    frequencies,
    margins,
    open_loop,
    phase_deg,
    uncompensated,
    zeros,
)
from tieline.linear.study import Study
from tieline.linear.sweep import PARAMETERS, sweep
from tieline.tables import Column, write_table

ZERO_BAND_HZ = (0.02, 0.35)
"""Where zeros are looked for: below the inter-area modes, where delay moves them most."""

FOLLOWED = ("frequency regulation", "inter-area")
DELAY_POINTS = 26

HEADINGS = {
    "real_1_per_s": "real, 1/s",
    "imag_rad_per_s": "imag, rad/s",
    "frequency_Hz": "Hz",
    "damping_ratio": "damping",
    "shape": "largest speeds",
    "first_Hz": "from Hz",
    "last_Hz": "to Hz",
    "first_damping": "from damping",
    "last_damping": "to damping",
    "least_pu": "least, pu",
    "most_pu": "most, pu",
    "last_pu": "last, pu",
}
"""What a terminal says over a column, where it is not the column's name."""

NOT_SHOWN = ("imag_rad_per_s", "mechanical_share", "states")
"""Columns that stand in the files only."""

_RANGE = re.compile(r"(?P<name>\w+)=(?P<first>[^:]+):(?P<last>[^:]+):(?P<points>\d+)")
_UNITS = {
    "_1_per_s": "1/s",
    "_rad_per_s": "rad/s",
    "_Hz": "Hz",
    "_dB": "dB",
    "_deg": "deg",
    "_s": "s",
}


@dataclass(frozen=True)
class Answer:
    """What a command found: tables by name, what draws figures, facts, and lines to say."""

    tables: dict[str, pd.DataFrame]
    figures: dict[str, Callable[[], Figure]]
    facts: dict[str, Any]
    lines: list[str]


def modes_answer(study: Study, delay_s: float, swept: str | None, with_controls: bool) -> Answer:
    """Return the modes of a case, with a delay of the average or along a sweep if asked for.

    Raises:
        InputError: a setting that the case does not allow, or a sweep that is malformed.
    """
    if swept is not None:
        if delay_s:
            raise InputError("--sweep and --delay do not go together: give one of them")
        return _sweep_answer(study, swept, with_controls)
    linear = linearise(study.system())
    found = modes_of(linear)
    if delay_s:
        return _delay_answer(found, delay_s)
    table = found.table()
    shown = table if with_controls else table[table["kind"] != "control"]
    shapes = _electromechanical(found)
    figures = {
        "modes": lambda: plots.pole_map(found),
        "shapes": lambda: plots.mode_shapes(found, shapes[:9].tolist()),
    }
    growing = table[table["real_1_per_s"] > 0]
    lines = [f"{len(growing)} of {len(table)} modes from 0.02 to 2.5 Hz grow"] if len(table) else []
    each = {f"{found.frequency_hz[k]:.4f} Hz": found.shape_table(int(k)) for k in shapes}
    joined = [frame.assign(mode=name) for name, frame in each.items()]
    tables = {"modes": shown}
    if joined:
        tables["shapes"] = pd.concat(joined, ignore_index=True)
    return Answer(tables, figures, {"modes_that_grow": len(growing)}, lines)


def freqresp_answer(
    study: Study, unit: str, delays_s: Sequence[float], gain: float, band_hz: tuple[float, float]
) -> Answer:
    """Return the open loop of one unit for some delays: response, zeros, margins.

    Raises:
        InputError: a setting that the case does not allow.
    """
    linear = linearise(study.system(), [unit])
    f = frequencies(band_hz)
    responses = {f"{delay:g} s": open_loop(linear, unit, delay) for delay in delays_s}
    curves = {label: loop.over(f) for label, loop in responses.items()}
    parts, found_zeros, found_margins, lines = [], {}, {}, []
    for (label, loop), delay in zip(responses.items(), delays_s, strict=True):
        H = curves[label]
        parts.append(
            pd.DataFrame(
                {
                    "delay_s": delay,
                    "frequency_Hz": f,
                    "H_real": H.real,
                    "H_imag": H.imag,
                    "gain_dB": decibel(H),
                    "phase_deg": phase_deg(H),
                }
            )
        )
        found_zeros[label] = zeros(loop, ZERO_BAND_HZ)
        margin = margins(loop, gain, band_hz)
        found_margins[label] = margin
        lines += [f"delay {label}: {text}" for text in _margin_texts(margin, gain)]
    poles = modes_of(linear).eigenvalues
    zero_table = pd.concat(
        [
            pd.DataFrame(
                {
                    "delay": label,
                    "real_1_per_s": found.real,
                    "imag_rad_per_s": found.imag,
                    "frequency_Hz": found.imag / (2 * np.pi),
                }
            )
            for label, found in found_zeros.items()
        ],
        ignore_index=True,
    )
    figures = {
        "bode": lambda: plots.bode(curves, f),
        "nyquist": lambda: plots.nyquist({label: gain * H for label, H in curves.items()}),
        "zeros": lambda: plots.pole_zero(poles, found_zeros, ZERO_BAND_HZ),
    }
    tables = {"zeros": zero_table, "response": pd.concat(parts, ignore_index=True)}
    bare = uncompensated(linear, unit)
    if bare is not None:
        first, with_washout = (
            next(iter(curves.values())),
            open_loop(bare, unit, delays_s[0]).over(f),
        )
        compensation = {
            "H": first,
            "uncompensated, with the washout": with_washout,
            "compensation": first / with_washout,
        }
        figures["compensation"] = lambda: plots.bode(compensation, f)
        tables["compensation"] = pd.DataFrame(
            {
                "frequency_Hz": f,
                "uncompensated_dB": decibel(with_washout),
                "uncompensated_deg": phase_deg(with_washout),
                "compensation_dB": decibel(compensation["compensation"]),
                "compensation_deg": phase_deg(compensation["compensation"]),
            }
        )
    facts = {
        "margins": {
            label: {name: values.tolist() for name, values in margin._asdict().items()}
            for label, margin in found_margins.items()
        }
    }
    return Answer(tables, figures, facts, lines)


def damping_answer(folder: Path, units: Sequence[str]) -> Answer:
    """Return the time-varying damping coefficient of units along a result.

    Raises:
        InputError: the folder is no result of one run, or there is no such unit.
    """
    time_s, found = damping_coefficients(folder, units)
    table = pd.DataFrame({"t_s": time_s, **{f"D_pu.{unit}": D for unit, D in found.items()}})
    extremes = pd.DataFrame(
        {
            "unit": list(found),
            "least_pu": [float(D.min()) for D in found.values()],
            "most_pu": [float(D.max()) for D in found.values()],
            "last_pu": [float(D[-1]) for D in found.values()],
        }
    )
    figures = {"damping": lambda: plots.damping_in_time(time_s, found)}
    return Answer({"extremes": extremes, "damping": table}, figures, {}, [])


def give(answer: Answer, out: Path | None, default: str, as_json: bool, console: Console) -> None:
    """Show an answer and write it: tables as Parquet and CSV, figures as PNG.

    Args:
        answer: what to give.
        out: the folder; by default `default`, and none at all for JSON alone.
        default: folder when none is named.
        as_json: print one JSON object instead of tables.
        console: where to print.
    """
    if as_json:
        data = {name: table.to_dict("list") for name, table in answer.tables.items()}
        text = json.dumps({**answer.facts, **data}, allow_nan=False, default=float)
        console.print(text, markup=False, highlight=False, soft_wrap=True)
    else:
        first = next(iter(answer.tables.values()))
        console.print(_shown(first))
        for line in answer.lines:
            console.print(line, markup=False, highlight=False, soft_wrap=True)
    if as_json and out is None:
        return
    folder = out or Path(default)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, table in answer.tables.items():
        table.to_csv(folder / f"{name}.csv", index=False)
        _write(folder / f"{name}.parquet", table)
        paths.append(folder / f"{name}.csv")
    with mpl.rc_context(STYLE):
        paths += save(folder, {name: draw() for name, draw in answer.figures.items()})
    if not as_json:
        for path in paths:
            console.print(shortest(path), markup=False, highlight=False, soft_wrap=True)


def _electromechanical(modes: Modes) -> Any:
    return modes.of_kind("frequency regulation", "inter-area", "local")


def _sweep_answer(study: Study, swept: str, with_controls: bool) -> Answer:
    name, values = _range(swept)
    found = sweep(study, name, values, mechanical_only=not with_controls)
    table = found.table()
    ends = table.groupby("mode").agg(["first", "last"])
    rows = pd.DataFrame(
        {
            "mode": ends.index,
            "kind": ends["kind"]["first"],
            "group": ends["group"]["first"],
            "first_Hz": ends["frequency_Hz"]["first"],
            "last_Hz": ends["frequency_Hz"]["last"],
            "first_damping": ends["damping_ratio"]["first"],
            "last_damping": ends["damping_ratio"]["last"],
        }
    ).reset_index(drop=True)
    lines = [f"{name} from {values[0]:g} to {values[-1]:g}: groups by how far a mode wanders"]
    return Answer(
        {"ends": rows, "locus": table}, {"locus": lambda: plots.root_locus(found)}, {}, lines
    )


def _delay_answer(found: Modes, delay_s: float) -> Answer:
    linear = found.linear
    values = delayed_eigenvalues(linear, delay_s, refined=True)
    f = values.imag / (2 * np.pi)
    inside = values[(f >= BAND_HZ[0]) & (f <= BAND_HZ[1])]
    inside = inside[np.argsort(inside.imag)]
    table = pd.DataFrame(
        {
            "real_1_per_s": inside.real,
            "imag_rad_per_s": inside.imag,
            "frequency_Hz": inside.imag / (2 * np.pi),
            "damping_ratio": -inside.real / np.abs(inside),
        }
    )
    places = [k for k in _electromechanical(found) if found.kinds[k] in FOLLOWED]
    delays = np.linspace(0.0, delay_s, DELAY_POINTS)
    followed = damping_against_delay(linear, delays[1:], found.eigenvalues[places])
    curves = {
        f"{found.frequency_hz[k]:.3f} Hz, {found.kinds[k]}": np.concatenate(
            [[found.eigenvalues[k]], followed.eigenvalues[:, column]]
        )
        for column, k in enumerate(places)
    }
    longest = max(10.0, delay_s)
    try:
        margin = delay_margin(linear, longest)
    except NumericalError as error:
        margin, text = None, f"the delay margin was not found: {error}"
    else:
        text = f"stable up to a delay of {longest:g} s at least"
        if margin is not None:
            text = f"delay margin {margin.delay_s:.3f} s, at {margin.f_hz:.3f} Hz"
            if not margin.is_stable_without_delay:
                text = "unstable without any delay"
    path = pd.DataFrame(
        {
            "delay_s": np.repeat(delays, len(curves)),
            "mode": list(curves) * len(delays),
            "real_1_per_s": np.array(list(curves.values())).T.real.ravel(),
            "imag_rad_per_s": np.array(list(curves.values())).T.imag.ravel(),
        }
    )
    margin_s = None if margin is None else margin.delay_s
    figures = {"delay": lambda: plots.damping_against_delay(delays, curves, margin_s)}
    return Answer({"modes": table, "paths": path}, figures, {"delay_margin_s": margin_s}, [text])


def _range(swept: str) -> tuple[str, list[float]]:
    """Return the parameter and the values that `NAME=FIRST:LAST:POINTS` asks for.

    Raises:
        InputError: it is not of this form.
    """
    match = _RANGE.fullmatch(swept)
    try:
        if match is None:
            raise ValueError
        first, last, points = float(match["first"]), float(match["last"]), int(match["points"])
        if points < 2:
            raise ValueError
    except ValueError as error:
        raise InputError(
            f"--sweep must be NAME=FIRST:LAST:POINTS, such as beta1=0:1:21, with NAME one of "
            f"{', '.join(PARAMETERS)} and at least 2 points (got {swept!r})"
        ) from error
    return match["name"], np.linspace(first, last, points).tolist()


def _margin_texts(margin: Any, gain: float) -> list[str]:
    texts = []
    if len(margin.gain_db):
        at = int(np.argmin(np.abs(margin.gain_db)))
        texts.append(
            f"gain margin {margin.gain_db[at]:.1f} dB at {margin.gain_hz[at]:.3f} Hz (K = {gain:g})"
        )
    if len(margin.phase_deg):
        at = int(np.argmin(np.abs(margin.phase_deg)))
        texts.append(
            f"phase margin {margin.phase_deg[at]:.1f} degrees at {margin.phase_hz[at]:.3f} Hz"
        )
    return texts or [f"no crossing with K = {gain:g}"]


def _shown(data: pd.DataFrame) -> Table:
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    # Beside the shape there is no room for the real part, which the damping tells.
    hidden = {*NOT_SHOWN, *(("real_1_per_s",) if "shape" in data else ())}
    names = [name for name in data.columns if name not in hidden]
    for name in names:
        is_number = pd.api.types.is_numeric_dtype(data[name])
        table.add_column(
            HEADINGS.get(name, name),
            justify="right" if is_number else "left",
            no_wrap=True,
            min_width=7 if is_number else None,
        )
    for row in data[names].itertuples(index=False):
        table.add_row(*(f"{v:.4f}" if isinstance(v, float) else str(v) for v in row))
    return table


def _write(path: Path, data: pd.DataFrame) -> None:
    def unit(name: str) -> str:
        return next((unit for end, unit in _UNITS.items() if name.endswith(end)), "")

    columns = []
    for name in data.columns:
        dtype = data[name].dtype.name if pd.api.types.is_numeric_dtype(data[name]) else "str"
        columns.append(Column(name, unit(name), COLUMNS.get(name, ""), dtype))
    write_table(path, columns, {name: data[name].to_numpy() for name in data.columns})

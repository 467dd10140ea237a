"""Computes items, judges their statements, and keeps figures and tables in a folder."""

import csv
import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from tieline.errors import InputError, TielineError
from tieline.figures import STYLE
from tieline.paper.item import Found, Item
from tieline.paper.runs import Runs
from tieline.paper.sources import PSTESS
from tieline.paper.statement import Row, Verdict, judged
from tieline.problems import near

VERDICTS_JSON, VERDICTS_CSV, FIGURES, RUNS = "verdicts.json", "verdicts.csv", "figures", "runs"
FORMAT = "tieline-reproduction/1"
DOTS_PER_INCH = 150
COLUMNS = ("item", "id", "statement", "source", "ours", "paper", "verdict", "why", "value", "unit")

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Result:
    """What came of an item.

    Attributes:
        item: what was computed.
        rows: its statements, judged.
        captions: of its figures, by the name that each file in the folder of figures has.
        wall_s: how long it took, waiting for its runs included, s.
        error: why it could not be computed, None if it was.
    """

    item: Item
    rows: tuple[Row, ...]
    captions: Mapping[str, str]
    wall_s: float
    error: TielineError | None = None


def chosen(items: Sequence[Item], only: Sequence[str]) -> tuple[Item, ...]:
    """Return the items of some names, all of them without a name, in their order.

    Raises:
        InputError: there is no such item.
    """
    known = [item.id for item in items]
    wrong = [f"no item '{name}'{near(name, known)}" for name in only if name not in known]
    if wrong:
        raise InputError([*wrong, f"there are: {', '.join(known)}"])
    return tuple(item for item in items if not only or item.id in only)


def check_target(target: Path) -> None:
    """Refuse a target that would overwrite what is no reproduction.

    Raises:
        InputError: the target is a file, or a folder with something else in it.
    """
    if target.exists() and not target.is_dir():
        raise InputError(f"--out {target} is a file: give a folder")
    if target.is_dir() and any(target.iterdir()) and not (target / VERDICTS_JSON).is_file():
        raise InputError(
            f"--out {target} holds files that are no reproduction: give a new or empty folder, "
            "or an earlier reproduction to replace"
        )


def reproduce(items: Sequence[Item], target: Path, runs: Runs, tell: Tell) -> list[Result]:
    """Return what came of each item, its figures written to the target's folder of figures.

    Runs of the federation are started at once and go on beside the items that need none. An item
    that fails leaves its statements without a number, and the others go on.

    Args:
        items: what to compute, in order.
        target: the folder.
        runs: makes the runs of the federation, and says whether the short form is asked for.
        tell: is given a line for each item.
    """
    figures = target / FIGURES
    figures.mkdir(parents=True, exist_ok=True)
    for item in items:
        for spec in item.runs(runs.quick):
            runs.start(spec)
    began_s = time.monotonic()
    results = []
    for number, item in enumerate(items, start=1):
        result = _computed(item, runs, figures)
        results.append(result)
        waits = f", {runs.ended} of {len(runs)} runs ended" if len(runs) else ""
        tell(
            f"[{number}/{len(items)}] {time.monotonic() - began_s:5.1f} s  {item.id}: "
            f"{_counted(result.rows)}{waits}"
        )
    return results


def count(results: Sequence[Result]) -> dict[Verdict, int]:
    """Return how many statements got each verdict."""
    rows = [row for result in results for row in result.rows]
    return {verdict: sum(row.verdict is verdict for row in rows) for verdict in Verdict}


def counted(results: Sequence[Result]) -> str:
    """Return the numbers of verdicts in words, and how many rows are no statement of the paper."""
    rows = [row for result in results for row in result.rows]
    others = sum(row.statement.source is PSTESS for row in rows)
    compared = f"; {others} of {len(rows)} rows compare with {PSTESS.name}" if others else ""
    return f"{_counted(rows, every=True)}{compared}"


def save_verdicts(results: Sequence[Result], target: Path, facts: Mapping[str, object]) -> None:
    """Write `verdicts.json` and `verdicts.csv` into the target."""
    records = [_record(row) for result in results for row in result.rows]
    with (target / VERDICTS_CSV).open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(records)
    data = {
        "format": FORMAT,
        **facts,
        "counts": {verdict.value: number for verdict, number in count(results).items()},
        "errors": {result.item.id: str(result.error) for result in results if result.error},
        "verdicts": records,
    }
    text = json.dumps(data, indent=2, allow_nan=False) + "\n"
    (target / VERDICTS_JSON).write_text(text, encoding="utf-8")


def _computed(item: Item, runs: Runs, figures: Path) -> Result:
    began_s = time.monotonic()
    error = None
    with mpl.rc_context(STYLE):
        try:
            found = item.compute(runs)
        except TielineError as failure:
            found, error = Found({}), failure
        for name, drawn in found.figures.items():
            _save(drawn.figure, figures / name, runs.quick)
    rows = tuple(judged(item.id, statement, found.numbers) for statement in item.statements)
    captions = {name: drawn.caption for name, drawn in found.figures.items()}
    return Result(item, rows, captions, time.monotonic() - began_s, error)


def _save(figure: Figure, stem: Path, quick: bool) -> None:
    figure.savefig(stem.with_suffix(".png"), dpi=DOTS_PER_INCH)
    # Drawing takes as long as all modes: the short form does it once.
    if not quick:
        figure.savefig(stem.with_suffix(".svg"))


def _counted(rows: Sequence[Row], every: bool = False) -> str:
    counts = {verdict: sum(row.verdict is verdict for row in rows) for verdict in Verdict}
    return ", ".join(f"{n} {verdict.value}" for verdict, n in counts.items() if n or every)


def _record(row: Row) -> dict[str, object]:
    return {
        "item": row.item,
        "id": row.statement.id,
        "statement": row.statement.text,
        "source": row.statement.source.name,
        "ours": row.ours,
        "paper": row.statement.paper,
        "verdict": row.verdict.value,
        "why": row.why,
        "value": row.value if math.isfinite(row.value) else None,
        "unit": row.statement.unit,
    }

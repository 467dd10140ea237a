"""Makes a result presentable: closing table, CSV, plots and page; reads the folder only."""

from collections.abc import Callable, Sequence
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from tieline.errors import InputError
from tieline.experiment.artist import Drawing, draw_here
from tieline.experiment.overrides import shortest
from tieline.experiment.results import SUMMARY, Run, read_manifest, read_runs
from tieline.experiment.table import FIELDS, Summary, shown, write_csv


def report(folder: Path, console: Console, draw: Callable[[Path], Drawing] = draw_here) -> None:
    """Write `table.csv`, `plots/` and `report.html`, and print the table and their paths.

    Args:
        folder: a result with a complete run.
        console: where it is printed.
        draw: writes page and figures.

    Raises:
        InputError: the folder is no result, or none of its runs is complete.
    """
    manifest = read_manifest(folder)
    runs = [run for run in read_runs(folder) if run.is_complete]
    if not runs:
        raise InputError(f"{folder} holds no complete run ({manifest['reason']})")
    summaries = [run.summary() for run in runs]
    write_csv(folder / "table.csv", summaries)
    page, plots = draw(folder)
    console.print(closing_table(summaries))
    for summary in summaries:
        if summary["ending"]:
            _say(console, f"{summary['label']}: {summary['ending']}")
        if summary["swing"]["reason"]:
            _say(console, f"{summary['label']}: no swing read off: {summary['swing']['reason']}")
    if manifest["status"] != "complete":
        _say(console, f"incomplete: {manifest['reason']}")
    _say(console, f"summary  {shortest(_summary_file(folder, runs))}")
    _say(console, f"table    {shortest(folder / 'table.csv')}")
    _say(console, f"report   {shortest(page)}")
    _say(console, f"plots    {', '.join(shortest(path) for path in plots)}")


def closing_table(summaries: Sequence[Summary]) -> Table:
    """Return the table of some runs, one row each; a single run needs no name in it."""
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    is_sweep = len(summaries) > 1
    if is_sweep:
        table.add_column("run", no_wrap=True)
    for field in FIELDS:
        table.add_column(field.heading, justify="right", no_wrap=True)
    for summary in summaries:
        cells = [shown(summary, field) for field in FIELDS]
        table.add_row(*([summary["label"]] if is_sweep else []), *cells)
    return table


def _summary_file(folder: Path, runs: Sequence[Run]) -> Path:
    path = folder / SUMMARY
    return path if path.is_file() else runs[0].folder / SUMMARY


def _say(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)

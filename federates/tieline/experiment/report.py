"""Makes a result presentable: closing table, CSV, plots and page; reads the folder only."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from tieline.aside import Aside
from tieline.errors import InputError
from tieline.experiment.overrides import shortest
from tieline.experiment.plots import draw, drawn_unit
from tieline.experiment.results import SUMMARY, Run, read_manifest, read_runs
from tieline.experiment.table import FIELDS, Summary, shown, write_csv
from tieline.report import write_page, write_point_pages
from tieline.report.network_figures import draw as draw_network
from tieline.report.network_figures import has_series, network_plots


def report(folder: Path, console: Console) -> None:
    """Write `table.csv`, `plots/` and `report.html`, and print the table and their paths.

    A single run with series of its network has figures of them too.

    Raises:
        InputError: the folder is no result, or none of its runs is complete.
    """
    manifest = read_manifest(folder)
    runs = [run for run in read_runs(folder) if run.is_complete]
    if not runs:
        raise InputError(f"{folder} holds no complete run ({manifest['reason']})")
    summaries = [run.summary() for run in runs]
    write_csv(folder / "table.csv", summaries)
    meanwhile = Aside(partial(_network_or_points, folder))
    plots = draw(folder / "plots", runs)
    meanwhile.join()
    # It has links to all that is there by now.
    page = write_page(folder, drawn_unit(runs[0]))
    plots += network_plots(folder)
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


def _network_or_points(folder: Path) -> None:
    """Draw a single run's network, if it has series; write the pages of a sweep's points."""
    if read_manifest(folder)["kind"] != "run":
        write_point_pages(folder)
    elif has_series(folder):
        draw_network(folder)


def _summary_file(folder: Path, runs: Sequence[Run]) -> Path:
    path = folder / SUMMARY
    return path if path.is_file() else runs[0].folder / SUMMARY


def _say(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)

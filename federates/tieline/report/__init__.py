"""Pages and figures of results; what is here reads result folders, and makes no result."""

from pathlib import Path

from tieline.experiment.results import Run, read_manifest, read_runs
from tieline.report.page import PAGE
from tieline.report.run_page import write_run_page
from tieline.report.sweep_page import write_sweep_page

MOST_PAGES = 24
"""Points of a sweep that get a page of their own; of more, one asks for those that matter."""

__all__ = ["PAGE", "write_page", "write_pages", "write_point_pages"]


def write_pages(folder: Path, unit: str | None = None) -> Path:
    """Write the page of a result, and of a sweep those of its points; return that of the whole.

    Args:
        folder: a run's or a sweep's.
        unit: the one whose curves are compared in a sweep; None for none.

    Raises:
        InputError: the folder is no result, or a file of it cannot be read.
    """
    write_point_pages(folder)
    return write_page(folder, unit)


def write_point_pages(folder: Path) -> None:
    """Write the pages of the points of a sweep, if it is one; nothing else need be there.

    Raises:
        InputError: as `write_pages`.
    """
    if read_manifest(folder)["kind"] == "run":
        return
    for run in read_runs(folder)[:MOST_PAGES]:
        if run.is_complete:
            write_run_page(run, f"../../{PAGE}")


def write_page(folder: Path, unit: str | None = None) -> Path:
    """Write the page of a whole result, and return it.

    It has links to the figures and to the pages of points that are there.

    Args:
        folder, unit: as those of `write_pages`.

    Raises:
        InputError: as `write_pages`.
    """
    runs = read_runs(folder)
    manifest = read_manifest(folder)
    if manifest["kind"] == "run":
        return write_run_page(runs[0], _sweep_of(runs[0]))
    return write_sweep_page(folder, manifest, runs, unit)


def _sweep_of(run: Run) -> str | None:
    """Return the page of the sweep that a run's folder is a point of, if there is one."""
    above = run.folder.absolute().parents
    return f"../../{PAGE}" if len(above) > 1 and (above[1] / PAGE).is_file() else None

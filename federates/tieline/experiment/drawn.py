"""Draws a result: figures of its grid and its network, and its page; reads the folder only."""

from pathlib import Path

from tieline.aside import Aside
from tieline.experiment.plots import draw, drawn_unit
from tieline.experiment.results import read_manifest, read_runs
from tieline.report import write_page, write_point_pages
from tieline.report.network_figures import draw as draw_network
from tieline.report.network_figures import has_series


def draw_result(folder: Path) -> tuple[Path, list[Path]]:
    """Write `plots/` and `report.html`, and return the page and the figures.

    At the same time a single run with series of its network has figures of them drawn, and the
    points of a sweep their pages written.

    Args:
        folder: of a result with at least one complete run.
    """
    runs = [run for run in read_runs(folder) if run.is_complete]
    with Aside(_network_or_points).begin(str(folder)) as others:
        plots = draw(folder / "plots", runs)
        plots += map(Path, others.join())
    # It has links to all that is there by now.
    return write_page(folder, drawn_unit(runs[0])), plots


def _network_or_points(folder: str) -> list[str]:
    """Draw a single run's network, if it has series; write the pages of a sweep's points."""
    if read_manifest(Path(folder))["kind"] != "run":
        write_point_pages(Path(folder))
        return []
    return [str(path) for path in draw_network(Path(folder))] if has_series(Path(folder)) else []

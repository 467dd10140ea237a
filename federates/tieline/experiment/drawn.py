"""Draws a result: figures of its grid and its network, and its page; reads the folder only."""

from pathlib import Path

from tieline.aside import Aside
from tieline.experiment.plots import draw, drawn_unit
from tieline.experiment.results import read_manifest, read_runs
from tieline.report import write_pages
from tieline.report.network_figures import draw as draw_network
from tieline.report.network_figures import has_series


def draw_result(folder: Path) -> tuple[Path, list[Path]]:
    """Write `plots/` and `report.html`, and return the page and the figures.

    A single run with series of its network has figures of them too, drawn at the same time.

    Args:
        folder: of a result with at least one complete run.
    """
    runs = [run for run in read_runs(folder) if run.is_complete]
    if read_manifest(folder)["kind"] != "run" or not has_series(folder):
        plots = draw(folder / "plots", runs)
        return write_pages(folder, drawn_unit(runs[0])), plots
    with Aside(_draw_network).begin(str(folder)) as network:
        plots = draw(folder / "plots", runs)
        page = write_pages(folder, drawn_unit(runs[0]))
        return page, [*plots, *map(Path, network.join())]


def _draw_network(folder: str) -> list[str]:
    return [str(path) for path in draw_network(Path(folder))]

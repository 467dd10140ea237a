"""Shows how far each run has come: a bar of simulated time, or plain lines off a terminal."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from tieline.experiment.sweep import Point

OnProgress = Callable[[Point, float], None]


@contextmanager
def shown_progress(points: Sequence[Point], console: Console) -> Iterator[OnProgress]:
    """Give a function that takes a point and the simulated time that it has reached, s."""
    if not console.is_terminal:
        yield _lines(points, console)
        return
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:.0f} s"),
        TimeElapsedColumn(),
        console=console,
    ) as progress:
        tasks: dict[str, TaskID] = {}

        def on_progress(point: Point, simulated_s: float) -> None:
            if point.slug not in tasks:
                name, total = _name(point), point.experiment.grid.duration
                tasks[point.slug] = progress.add_task(name, total=total)
            progress.update(tasks[point.slug], completed=simulated_s)

        yield on_progress


def _lines(points: Sequence[Point], console: Console) -> OnProgress:
    """Return a reporter that prints one line when a run begins and one at each quarter."""
    reached: dict[str, int] = {}

    def on_progress(point: Point, simulated_s: float) -> None:
        duration_s = point.experiment.grid.duration
        quarter = int(4 * simulated_s / duration_s)
        if quarter <= reached.get(point.slug, -1):
            return
        reached[point.slug] = quarter
        place = f"[{points.index(point) + 1}/{len(points)}] " if len(points) > 1 else ""
        text = f"{place}{_name(point)}: {simulated_s:.1f} of {duration_s:g} s"
        console.print(text, markup=False, highlight=False)

    return on_progress


def _name(point: Point) -> str:
    return point.label or point.experiment.name

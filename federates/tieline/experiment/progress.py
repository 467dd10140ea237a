"""Shows how far runs have come, how fast and how long it will take; plain lines off a terminal."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskID, TextColumn
from rich.text import Text

from tieline.errors import TielineError
from tieline.experiment.sweep import Point
from tieline.experiment.sweep_run import Listener

Clock = Callable[[], float]


@contextmanager
def shown_progress(
    points: Sequence[Point], console: Console, clock: Clock = time.monotonic
) -> Iterator[Listener]:
    """Give what listens to the course of some runs and shows it.

    Args:
        points: all of them; more than one is a sweep.
        console: where it is shown; nothing is if it is quiet.
        clock: wall time, s.
    """
    if console.quiet:
        yield Listener()
    elif console.is_terminal:
        with _Bars(points, console) as bars:
            yield Listener(bars.reached, bars.kept, bars.ended)
    else:
        lines = _Lines(points, console, clock)
        yield Listener(lines.reached, lines.kept, lines.ended)


class Pace:
    """Simulated time against wall time since a run was first heard of.

    Args:
        total_s: simulated time at the end.
        clock: wall time, s.
    """

    def __init__(self, total_s: float, clock: Clock) -> None:
        self._total_s = total_s
        self._clock = clock
        self._first: tuple[float, float] | None = None

    def text(self, reached_s: float) -> str:
        """Return how far, how fast and how long still: `20.5 of 41 s, 3.1 x real time, 7 s left`.

        The pace is left out while nothing is known of it, and what is left at the end.
        """
        now_s = self._clock()
        far = f"{reached_s:.1f} of {self._total_s:g} s"
        if self._first is None:
            self._first = now_s, reached_s
        wall_s, simulated_s = now_s - self._first[0], reached_s - self._first[1]
        if wall_s <= 0 or simulated_s <= 0:
            return far
        rate = simulated_s / wall_s
        left_s = (self._total_s - reached_s) / rate
        end = f", {duration(left_s)} left" if left_s > 0 else ""
        return f"{far}, {rate:.2g} x real time{end}"


def duration(seconds: float) -> str:
    """Return a time as people say it: `7 s`, `2 min 05 s`, `1 h 20 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


class _Lines:
    """A line at each quarter of a single run, or at the end of each point of a sweep."""

    def __init__(self, points: Sequence[Point], console: Console, clock: Clock) -> None:
        self._points = points
        self._console = console
        self._clock = clock
        self._quarters: dict[str, int] = {}
        self._paces: dict[str, Pace] = {}
        self._tally = Tally(len(points), clock)

    def reached(self, point: Point, simulated_s: float) -> None:
        """Say at each quarter how far a single run has come."""
        if len(self._points) > 1:
            return
        total_s = point.experiment.grid.duration
        quarter = int(4 * simulated_s / total_s)
        pace = self._paces.setdefault(point.slug, Pace(total_s, self._clock))
        text = pace.text(simulated_s)
        if quarter > self._quarters.get(point.slug, -1):
            self._quarters[point.slug] = quarter
            self._say(f"{name_of(point)}: {text}")

    def kept(self, points: Sequence[Point]) -> None:
        """Say how many points were finished before."""
        self._tally.keep(len(points))
        if points:
            self._say(f"{len(points)} of {len(self._points)} points were finished before")

    def ended(self, point: Point, error: TielineError | None) -> None:
        """Say that a point has ended, and how much is left."""
        self._tally.end(error is not None)
        how = "complete" if error is None else f"failed: {str(error).splitlines()[0]}"
        left = self._tally.left()
        self._say(f"[{self._tally.text()}] {name_of(point)}: {how}{left and f', {left}'}")

    def _say(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)


class Tally:
    """How many points of a sweep have ended, and when the last of them will have."""

    def __init__(self, count: int, clock: Clock) -> None:
        self.ended = 0
        self.failed = 0
        self.count = count
        self._kept = 0
        self._clock = clock
        self._begin_s = clock()

    def keep(self, count: int) -> None:
        """Count points that were finished before."""
        self._kept = count
        self.ended += count

    def end(self, is_failed: bool) -> None:
        """Count one more."""
        self.ended += 1
        self.failed += is_failed

    def text(self) -> str:
        """Return `3/100`."""
        return f"{self.ended}/{self.count}"

    def left(self) -> str:
        """Return `2 min 05 s left`, or nothing where that is not known or nothing is left."""
        run = self.ended - self._kept
        if run == 0 or self.ended == self.count:
            return ""
        elapsed_s = self._clock() - self._begin_s
        return f"{duration(elapsed_s / run * (self.count - self.ended))} left"


class _Bars:
    """A bar for each run under way, and one for a sweep."""

    def __init__(self, points: Sequence[Point], console: Console) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            _Far(),
            _Rate(),
            console=console,
            # It would take a thread, and a process with threads cannot fork federates.
            auto_refresh=False,
        )
        self._points = points
        self._tasks: dict[str, TaskID] = {}
        self._tally = Tally(len(points), time.monotonic)
        self._sweep: TaskID | None = None

    def __enter__(self) -> "_Bars":
        self._progress.__enter__()
        if len(self._points) > 1:
            self._sweep = self._progress.add_task("points", total=len(self._points), pace="")
        return self

    def __exit__(self, *exit_: object) -> None:
        self._progress.stop()

    def reached(self, point: Point, simulated_s: float) -> None:
        """Move the bar of a run."""
        if point.slug not in self._tasks:
            total_s = point.experiment.grid.duration
            task = self._progress.add_task(name_of(point), total=total_s, is_time=True)
            self._tasks[point.slug] = task
        self._progress.update(self._tasks[point.slug], completed=simulated_s, refresh=True)

    def kept(self, points: Sequence[Point]) -> None:
        """Move the bar of the sweep by what was finished before."""
        self._tally.keep(len(points))
        self._move()

    def ended(self, point: Point, error: TielineError | None) -> None:
        """Remove the bar of a point, name it if it failed, and move the bar of the sweep."""
        self._tally.end(error is not None)
        if point.slug in self._tasks:
            self._progress.remove_task(self._tasks.pop(point.slug))
        if error is not None:
            text = f"{name_of(point)}: failed: {str(error).splitlines()[0]}"
            self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)
        self._move()

    def _move(self) -> None:
        if self._sweep is not None:
            done, left = self._tally.ended, self._tally.left()
            self._progress.update(self._sweep, completed=done, pace=left, refresh=True)


class _Far(ProgressColumn):
    """How far: simulated seconds of a run, points of a sweep."""

    def render(self, task: Task) -> Text:
        """Return the cell."""
        if task.fields.get("is_time"):
            return Text(f"{task.completed:.1f} of {task.total:g} s")
        return Text(f"{task.completed:.0f} of {task.total:.0f}")


class _Rate(ProgressColumn):
    """How fast, and how long still."""

    def render(self, task: Task) -> Text:
        """Return the cell."""
        if not task.fields.get("is_time"):
            return Text(str(task.fields["pace"]))
        if not task.speed or task.remaining is None:
            return Text("")
        left = f", {duration(task.remaining / task.speed)} left" if task.remaining > 0 else ""
        return Text(f"{task.speed:.2g} x real time{left}")


def name_of(point: Point) -> str:
    """Return what a run is called."""
    return point.label or point.experiment.name

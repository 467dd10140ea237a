"""What is shown of the course of a run: how far, how fast, how long still."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from synthetic_result import EXPERIMENT, SWEEP, plan_of
from tieline.errors import CosimError
from tieline.experiment.progress import Pace, Tally, duration, shown_progress


class Clock:
    """Wall time that a test sets."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_the_pace_is_simulated_against_wall_time() -> None:
    """Otherwise nobody could tell whether to wait or to come back tomorrow."""
    clock = Clock()
    pace = Pace(41.0, clock)
    assert pace.text(1.0) == "1.0 of 41 s"
    clock.now_s += 5.0
    # 20 s in 5 s are 4 a second, so the last 20 s take 5 s more.
    assert pace.text(21.0) == "21.0 of 41 s, 4 x real time, 5 s left"
    clock.now_s += 5.0
    assert pace.text(41.0) == "41.0 of 41 s, 4 x real time"


def test_what_is_left_of_a_sweep_counts_what_was_run_only() -> None:
    """Otherwise points that were finished before would promise a pace that nothing keeps."""
    clock = Clock()
    tally = Tally(10, clock)
    tally.keep(5)
    assert (tally.text(), tally.left()) == ("5/10", "")
    clock.now_s += 60.0
    tally.end(is_failed=False)
    assert (tally.text(), tally.left()) == ("6/10", "4 min 00 s left")


@pytest.mark.parametrize(
    ("seconds", "text"), [(7.4, "7 s"), (125, "2 min 05 s"), (4800, "1 h 20 min")]
)
def test_a_duration_is_told_as_people_say_it(seconds: float, text: str) -> None:
    """Otherwise one would have to divide by 3600."""
    assert duration(seconds) == text


@pytest.mark.parametrize("is_terminal", [False, True])
def test_a_sweep_tells_of_each_point(tmp_path: Path, is_terminal: bool) -> None:
    """Otherwise a failed point would be found at the end of the night."""
    points = plan_of(tmp_path, EXPERIMENT + SWEEP).study.points
    file = io.StringIO()
    console = Console(file=file, force_terminal=is_terminal, width=80)
    with shown_progress(points, console) as listener:
        assert listener.on_kept is not None
        assert listener.on_time is not None
        assert listener.on_end is not None
        listener.on_kept([])
        listener.on_time(points[0], 20.5)
        listener.on_end(points[0], None)
        listener.on_end(points[1], CosimError("lost\n  | last words"))
    text = file.getvalue()
    assert "0.25 s: failed: lost\n" in text
    assert "last words" not in text
    assert ("[1/2] ideal: complete" in text) is not is_terminal


def test_a_quiet_console_shows_nothing(tmp_path: Path) -> None:
    """Otherwise a script would have to filter it."""
    console = Console(quiet=True)
    with shown_progress(plan_of(tmp_path).study.points, console) as listener:
        assert listener.on_time is None

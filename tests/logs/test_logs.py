"""The logs of a run: capped, merged in a defined order, and readable whatever befell the run."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.errors import InputError
from tieline.logs import LEVELS, Log, Record, chosen, merge, records, shown
from tieline.logs.record import LONGEST_TEXT

SOME = Record(1_500_000_000, "2026-01-02T03:04:05.000006Z", 7, "info", "grid", "state", "runs")


def write(folder: Path, process: str, lines: Sequence[tuple[int | None, int, str]]) -> None:
    """Write a log of (simulated time in ns, second of wall time, message)."""
    path = folder / "logs" / f"{process}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        for t_ns, second, message in lines:
            wall = f"2026-01-01T00:00:{second:02d}.000000Z"
            record = Record(t_ns, wall, second * 10**9, "info", process, "log", message)
            file.write(record.to_line() + b"\n")


def messages(folder: Path) -> list[str]:
    """Return the messages of the merged log."""
    return [record.message for record in records(folder)]


@settings(max_examples=30, deadline=None)
@given(
    st.one_of(st.none(), st.integers(0, 10**15)),
    st.sampled_from(LEVELS),
    st.text(),
    st.dictionaries(st.text(), st.one_of(st.text(), st.integers(), st.none())),
)
def test_a_record_comes_back_from_its_line(
    t_ns: int | None, level: str, message: str, fields: dict[str, object]
) -> None:
    """Otherwise what a process said would reach the reader changed, or break the file's lines."""
    record = Record(t_ns, SOME.wall, 7, level, "grid", "log", message, fields)
    line = record.to_line()
    assert b"\n" not in line
    assert Record.from_line(line) == record


def test_a_text_that_is_too_long_keeps_its_beginning_and_its_end() -> None:
    """Otherwise one endless line would be the whole log, or lose the error at its end."""
    record = Record.from_line(
        Record(None, SOME.wall, 7, "info", "grid", "log", f"a{'x' * 10 * LONGEST_TEXT}z").to_line()
    )
    assert len(record.message) < 2 * LONGEST_TEXT
    assert (record.message[0], record.message[-1]) == ("a", "z")
    assert "characters left out" in record.message


@pytest.mark.parametrize("line", ["", "{}", '{"t_ns": 1', '{"t_ns": -1}', "[1]", "null"])
def test_what_is_no_record_is_refused(line: str) -> None:
    """Otherwise a program that prints JSON could pass for a federate's log."""
    with pytest.raises(ValueError, match="no record of a log"):
        Record.from_line(line)


def test_a_log_stops_growing_and_keeps_its_beginning_and_its_end(tmp_path: Path) -> None:
    """Otherwise a federate that complains in a loop would fill the disk, or hide why it died."""
    log = Log(tmp_path / "logs" / "grid.jsonl", "grid", head_bytes=10_000, tail_bytes=5_000)
    for number in range(1000):
        log.take(f"line {number}".encode(), is_error=False)
    assert (tmp_path / "logs" / "grid.jsonl").stat().st_size < 10_600
    log.close()
    found = messages(tmp_path)
    assert (tmp_path / "logs" / "grid.jsonl").stat().st_size < 16_000
    assert found[0] == "line 0"
    assert found[-1] == "line 999"
    kept = [text for text in found if text.startswith("line ")]
    remarks = [text for text in found if text not in kept]
    assert "the log is full" in remarks[0]
    assert remarks[1] == f"{1000 - len(kept)} lines were left out here: the log was full"
    assert list(log.tail)[-1] == "line 999"


def test_a_full_disk_costs_the_lines_and_not_the_run() -> None:
    """Otherwise a log, of all things, would end a run that could still save its tables."""
    log = Log(Path("/dev/full"), "grid")
    log.take(b"first", is_error=True)
    log.take(b"last", is_error=True)
    log.close()
    assert "cannot be written: No space left" in " ".join(log.tail)
    assert "last" in log.tail


def test_what_is_printed_has_a_level_and_the_time_that_the_run_has_reached(tmp_path: Path) -> None:
    """Otherwise nobody could pick the warnings, or tell when in the run they came."""
    times = iter([None, 1_000_000_000, 1_000_000_000, 2_000_000_000])
    log = Log(tmp_path / "logs" / "grid.jsonl", "grid", lambda: next(times))
    log.take(b"hello", is_error=False)
    log.take(b"[2026-11-22 14:01:04.867] [console] [warning] route lost", is_error=False)
    log.take(b"Traceback (most recent call last):", is_error=True)
    log.take(b"by the way", is_error=True)
    log.close()
    found = [(r.t_ns, r.level, r.event, r.message) for r in records(tmp_path)]
    assert found == [
        (None, "info", "stdout", "hello"),
        (1_000_000_000, "warning", "helics", "route lost"),
        (1_000_000_000, "error", "stderr", "Traceback (most recent call last):"),
        (2_000_000_000, "warning", "stderr", "by the way"),
    ]


def test_states_are_told_at_once_and_grants_only_now_and_then(tmp_path: Path) -> None:
    """Otherwise a long run's log would be full of grants, or miss when a federate joined."""
    log = Log(tmp_path / "logs" / "grid.jsonl", "grid")
    for k in range(-1, 500):
        state = "opening" if k < 0 else "running"
        log.hear({"federate": "grid", "state": state, "k": k, "granted_ns": max(-1, k * 10**7)})
    word = {"federate": "grid", "state": "failed", "fault": "own", "reason": "no rest"}
    log.hear({**word, "k": 499, "granted_ns": 499 * 10**7})
    log.close()
    found = list(records(tmp_path))
    assert [record.message for record in found] == [
        "grid is opening",
        "grid is running",
        "grid has failed: no rest",
    ]
    assert [(record.t_ns, record.level) for record in found] == [
        (None, "info"),
        (0, "info"),
        (4_990_000_000, "error"),
    ]


def test_logs_are_merged_by_simulated_time_and_then_by_wall_time(tmp_path: Path) -> None:
    """Otherwise a cause would stand after its effect."""
    write(tmp_path, "grid", [(None, 5, "g joins"), (10, 20, "g at 10"), (30, 21, "g at 30")])
    write(tmp_path, "network", [(None, 3, "n joins"), (10, 19, "n at 10"), (20, 40, "n at 20")])
    expected = ["n joins", "g joins", "n at 10", "g at 10", "n at 20", "g at 30"]
    assert messages(tmp_path) == expected
    assert merge(tmp_path) == tmp_path / "logs" / "run.jsonl"
    assert messages(tmp_path) == expected
    assert merge(tmp_path) is not None
    assert messages(tmp_path) == expected


def test_a_merge_never_changes_the_order_of_one_process(tmp_path: Path) -> None:
    """Otherwise a host's clock that is set back would turn its story around."""
    write(tmp_path, "grid", [(None, 9, "a"), (50, 5, "b"), (None, 6, "c"), (40, 1, "d")])
    write(tmp_path, "broker", [(None, 10, "x"), (45, 2, "y")])
    found = messages(tmp_path)
    assert [text for text in found if text in "abcd"] == ["a", "b", "c", "d"]
    assert found == ["a", "x", "y", "b", "c", "d"]


def test_the_log_of_a_killed_launcher_is_read_up_to_its_damaged_end(tmp_path: Path) -> None:
    """Otherwise the runs whose logs matter most would have none."""
    write(tmp_path, "grid", [(None, 1, "first"), (10, 2, "second")])
    path = tmp_path / "logs" / "grid.jsonl"
    path.write_bytes(path.read_bytes()[:-40])
    first, last = records(tmp_path)
    assert first.message == "first"
    assert (last.level, last.event) == ("warning", "damaged")


def test_a_log_shows_what_was_asked_for(tmp_path: Path) -> None:
    """Otherwise a reader would wade through all of it."""
    write(tmp_path, "grid", [(None, 1, "a"), (10**9, 2, "b"), (2 * 10**9, 3, "c")])
    write(tmp_path, "network", [(2 * 10**9, 4, "d")])

    def asked(**choice: object) -> str:
        return "".join(r.message for r in chosen(records(tmp_path), **choice))  # type: ignore[arg-type]

    assert asked() == "abcd"
    assert asked(process="grid") == "abc"
    assert asked(from_s=1.0) == "bcd"
    assert asked(to_s=1.0) == "ab"
    assert asked(level="warning") == ""
    line = shown(Record.from_line(SOME.to_line()))
    assert line.split() == ["1.500000", "s", "03:04:05.000006", "info", "grid", "runs"]


def test_a_folder_without_logs_is_refused_in_words(tmp_path: Path) -> None:
    """Otherwise an empty answer would look like a silent run."""
    assert merge(tmp_path) is None
    with pytest.raises(InputError, match="has no logs"):
        list(records(tmp_path))


def test_a_line_of_the_file_is_plain_json(tmp_path: Path) -> None:
    """Otherwise jq, pandas and whatever else reads JSON lines could not."""
    write(tmp_path, "grid", [(10, 1, "b")])
    (line,) = (tmp_path / "logs" / "grid.jsonl").read_text().splitlines()
    assert json.loads(line) == {
        "t_ns": 10,
        "wall": "2026-01-01T00:00:01.000000Z",
        "monotonic_ns": 10**9,
        "level": "info",
        "process": "grid",
        "event": "log",
        "message": "b",
        "fields": {},
    }

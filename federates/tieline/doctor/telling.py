"""Puts what became of a run into words."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from tieline.doctor.last import Story

_WIDTH = 15


def told(story: Story) -> str:
    """Return a story as text, one heading a line."""
    return "\n".join(_lines(story))


def as_data(story: Story) -> dict[str, Any]:
    """Return a story as JSON has it; of the cause its name, usual reason and advice."""
    data = asdict(story) | {"folder": str(story.folder)}
    if story.cause is not None:
        data["cause"] = {key: data["cause"][key] for key in ("name", "usual", "advice")}
    return data


def _lines(story: Story) -> Iterator[str]:
    yield f"{story.folder} ({story.name}) is {story.status}."
    if story.status == "under way":
        yield f"tieline log {story.folder} shows how far it is."
        return
    if story.status == "complete":
        yield from _data(story)
        return
    who = f"{story.culprit}: " if story.culprit else ""
    yield _item("What happened", f"{who}{story.reason}")
    yield _item("When", _when(story))
    for name, doing in story.others.items():
        yield _item(f"Then {name}", doing)
    if story.lines:
        yield _item("Last lines", f"of {story.culprit or 'the run'}")
        yield from (f"  | {line}" for line in story.lines)
    if story.cause is not None:
        yield _item("Usual cause", story.cause.usual)
        yield _item("What to do", story.cause.advice)
    yield from _data(story)
    yield _item("All of it", f"tieline log {story.folder}")


def _when(story: Story) -> str:
    reached = "before the first grant" if story.reached_s is None else f"at {story.reached_s:.6f} s"
    wall = f", {story.wall} of wall time" if story.wall else ""
    return f"{reached} of {story.simulated_s:g} s of simulated time{wall}"


def _data(story: Story) -> Iterator[str]:
    if not story.tables:
        if story.simulated_s:
            yield _item("Readable", "no table was written")
        return
    parts = [
        name if until_s is None else f"{name} (to {until_s:g} s)"
        for name, until_s in story.tables.items()
    ]
    yield _item("Readable", ", ".join(parts))
    if story.made:
        yield _item("", f"made just now of what was streamed to disk: {', '.join(story.made)}")


def _item(heading: str, text: str) -> str:
    return f"{heading:<{_WIDTH}}{text}"

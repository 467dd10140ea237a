"""Draws a result in a process that is ready for it before there is a result."""

from collections.abc import Callable
from pathlib import Path

from tieline.aside import Aside

Drawing = tuple[Path, list[Path]]
"""The page and the figures of a result."""


def draw_here(folder: Path) -> Drawing:
    """Write page and figures of a result from this process, and return them.

    Raises:
        InputError: a file of the result cannot be read.
    """
    return _what_draws()(folder)


class Artist(Aside):
    """A fork that imports what drawing needs while a run goes on, and draws when told.

    The process that has the run then waits for none of it, and never holds it in its memory.
    """

    def __init__(self) -> None:
        super().__init__(_answer, _what_draws)

    def draw(self, folder: Path) -> Drawing:
        """Do as `draw_here`, in the fork."""
        page, *figures = map(Path, self.begin(str(folder)).join())
        return page, figures


def _what_draws() -> Callable[[Path], Drawing]:
    from tieline.experiment.drawn import draw_result

    return draw_result


def _answer(folder: str) -> list[str]:
    page, figures = draw_here(Path(folder))
    return [str(page), *map(str, figures)]

"""Small items and makers of runs for tests of the reproduction."""

import threading
from pathlib import Path

from matplotlib.figure import Figure

from tieline.errors import NumericalError
from tieline.paper import Band, Found, Item, Source, Spec, Statement
from tieline.paper.item import Drawn, Work

SOURCE = Source("a note", "somebody's note")


def statement(name: str = "s", **changes: object) -> Statement:
    """Return a statement that 0.9 to 1.1 makes true."""
    settings: dict = {
        "id": name,
        "text": "it is <about> one",
        "source": SOURCE,
        "number": "it",
        "paper": "1 | one",
        "band": Band(0.9, 1.1),
        "tolerance": "a tenth",
    }
    return Statement(**{**settings, **changes})


def item(name: str, value: float, **changes: object) -> Item:
    """Return an item that finds a number, and draws it."""

    def compute(work: Work) -> Found:
        figure = Figure(figsize=(2, 2))
        figure.subplots().plot([0, value])
        return Found({"it": value}, {f"of_{name}": Drawn(figure, "a <line>")})

    return Item(name, f"Item {name}", "a line", "a number", (statement(name, **changes),), compute)


def broken(name: str) -> Item:
    """Return an item whose computation fails."""

    def compute(work: Work) -> Found:
        raise NumericalError("it diverges")

    return Item(name, "Broken", "nothing", "nothing", (statement(name),), compute)


class Maker:
    """Notes what it is asked to make, and how many go on at a time."""

    def __init__(self, log: "Log") -> None:
        self._log = log
        self.is_closed = False
        log.makers.append(self)

    def make(self, spec: Spec, target: Path) -> Path:
        with self._log.lock:
            self._log.made.append(spec)
            self._log.under_way += 1
            self._log.most = max(self._log.most, self._log.under_way)
        if self._log.gate is not None:
            self._log.gate.wait(10)
        with self._log.lock:
            self._log.under_way -= 1
        return target

    def close(self) -> None:
        self.is_closed = True


class Log:
    """What makers did."""

    def __init__(self, gate: threading.Barrier | None = None) -> None:
        self.lock = threading.Lock()
        self.gate = gate
        self.makers: list[Maker] = []
        self.made: list[Spec] = []
        self.under_way = 0
        self.most = 0

    def maker(self) -> Maker:
        return Maker(self)

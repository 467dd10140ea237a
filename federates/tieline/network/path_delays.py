"""Where the `empirical` engine's delays come from: distributions, or measured delays in a CSV."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.network.findings import nearest
from tieline.network.jitter import Jitter
from tieline.network.settings import MAX_DELAY_S, EmpiricalSettings
from tieline.units import NS_PER_S, seconds_to_ns

Sites = Sequence[Mapping[str, Any]]

CHUNK = 256
"""Delays drawn at a time for each path."""

_ALL = ["delay_s"]
_BY_PATH = ["source", "destination", "delay_s"]
_MOST_FINDINGS = 20


class PathDelay(Protocol):
    """The delays of one path's packets."""

    @property
    def least_ns(self) -> int:
        """No delay is below this."""

    def chunks(self, generator: np.random.Generator) -> Iterator[NDArray[np.int64]]:
        """Yield `CHUNK` delays in ns at a time, without end."""


@dataclass(frozen=True)
class DrawnDelay:
    """An offset and, on top of it, an independent draw from a distribution for each packet."""

    jitter: Jitter
    offset_ns: int

    @property
    def least_ns(self) -> int:
        """The offset and the distribution's lower end."""
        return self.offset_ns + self.jitter.least_ns

    def chunks(self, generator: np.random.Generator) -> Iterator[NDArray[np.int64]]:
        """Yield draws."""
        while True:
            yield self.offset_ns + self.jitter.draw(generator, CHUNK)


@dataclass(frozen=True, eq=False)
class MeasuredDelay:
    """Measured delays: one of them at random for each packet, or one after the other.

    Taken in turn they begin again after the last. Taken at random they keep their distribution, but
    not how a delay depends on the one before.

    Attributes:
        delays_ns: (samples,) at least one.
        is_in_turn: one after the other.
    """

    delays_ns: NDArray[np.int64]
    is_in_turn: bool

    @property
    def least_ns(self) -> int:
        """The shortest of them."""
        return int(self.delays_ns.min())

    def chunks(self, generator: np.random.Generator) -> Iterator[NDArray[np.int64]]:
        """Yield some of them."""
        count = len(self.delays_ns)
        place = 0
        while True:
            if self.is_in_turn:
                yield self.delays_ns[(place + np.arange(CHUNK)) % count]
                place = (place + CHUNK) % count
            else:
                yield self.delays_ns[generator.integers(0, count, CHUNK)]


def path_delays(
    settings: EmpiricalSettings, sources: Sites, destinations: Sites
) -> list[PathDelay]:
    """Return the delays of each path, source by source and destination by destination.

    Args:
        settings: what the experiment says.
        sources: `name` and `bus` of each PMU.
        destinations: `name` and `unit` of each controller.

    Raises:
        InputError: the CSV is faulty or lacks a path, or the settings name an unknown site.
    """
    names = _Names(sources, destinations)
    is_in_turn = settings.draw == "in_turn"
    if settings.trace is not None:
        measured = read_trace(Path(settings.trace), sources, destinations)
        return [MeasuredDelay(delays_ns, is_in_turn) for delays_ns in measured]
    assert settings.distribution is not None
    common = DrawnDelay(settings.distribution.jitter(), seconds_to_ns(settings.offset))
    delays: list[PathDelay] = [common] * (len(sources) * len(destinations))
    findings = []
    for index, path in enumerate(settings.paths):
        flow, wrong = names.flow(path.source, path.destination)
        findings += [f"network.empirical.paths[{index}]: {text}" for text in wrong]
        if not wrong:
            offset_ns = seconds_to_ns(path.offset)
            delays[flow] = DrawnDelay(path.distribution.jitter(), offset_ns)
    if findings:
        raise InputError(findings)
    return delays


def read_trace(path: Path, sources: Sites, destinations: Sites) -> list[NDArray[np.int64]]:
    """Return the delays of each path in ns, in the order of the file.

    The file has one column `delay_s`, for all paths alike, or `source,destination,delay_s`, where a
    source is a PMU's name or bus and a destination a controller's name or unit.

    Raises:
        InputError: with `file:line` for each finding.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {error}") from error
    rows = csv.reader(text.splitlines())
    try:
        return _delays_of(path, rows, _Names(sources, destinations))
    except csv.Error as error:
        raise InputError(f"{path}:{rows.line_num}: is malformed ({error})") from error


def _delays_of(path: Path, rows: Any, names: "_Names") -> list[NDArray[np.int64]]:
    header = [name.strip() for name in next(rows, [])]
    if header not in (_ALL, _BY_PATH):
        raise InputError(
            f"{path}:1: the columns must be '{_ALL[0]}' or '{','.join(_BY_PATH)}'"
            f" (got '{','.join(header)}')"
        )
    lists: list[list[float]] = [[] for _ in range(names.paths if header == _BY_PATH else 1)]
    findings: list[str] = []
    for row in rows:
        if row and len(findings) < _MOST_FINDINGS:
            wrong = _take_row(row, header, names, lists)
            findings += [f"{path}:{rows.line_num}: {text}" for text in wrong]
    if not findings:
        findings = [f"{path}: {text}" for text in _missing(lists, names)]
    if findings:
        raise InputError(findings)
    samples = [np.rint(np.array(delays_s) * NS_PER_S).astype(np.int64) for delays_s in lists]
    return samples if header == _BY_PATH else samples * names.paths


class _Names:
    """Path numbers by the names that users know: PMUs by name or bus, controllers by unit, too."""

    def __init__(self, sources: Sites, destinations: Sites) -> None:
        self._sources = sources
        self._destinations = destinations
        self.paths = len(sources) * len(destinations)
        self._source = {str(site["bus"]): i for i, site in enumerate(sources)}
        self._source |= {str(site["name"]): i for i, site in enumerate(sources)}
        self._destination = {str(site["unit"]): j for j, site in enumerate(destinations)}
        self._destination |= {str(site["name"]): j for j, site in enumerate(destinations)}

    def flow(self, source: str, destination: str) -> tuple[int, list[str]]:
        """Return the number of a path, and what is wrong with its names."""
        wrong = []
        if source not in self._source:
            wrong.append(f"unknown source '{source}'{nearest(source, self._source)}")
        if destination not in self._destination:
            hint = nearest(destination, self._destination)
            wrong.append(f"unknown destination '{destination}'{hint}")
        if wrong:
            return 0, wrong
        return self._source[source] * len(self._destinations) + self._destination[destination], []

    def of(self, flow: int) -> str:
        """Return the two names of a path."""
        i, j = divmod(flow, len(self._destinations))
        return f"{self._sources[i]['name']} to {self._destinations[j]['name']}"


def _take_row(
    row: list[str], header: list[str], names: _Names, lists: list[list[float]]
) -> list[str]:
    """Add a row's delay to its path's; return what is wrong with the row instead."""
    if len(row) != len(header):
        return [f"a row must have {len(header)} values (got {len(row)})"]
    flow, wrong = names.flow(row[0].strip(), row[1].strip()) if len(row) > 1 else (0, [])
    try:
        delay_s = float(row[-1])
    except ValueError:
        return [*wrong, f"delay_s must be a number (got '{row[-1]}')"]
    if not 0 <= delay_s <= MAX_DELAY_S:
        wrong.append(f"delay_s must be 0 to {MAX_DELAY_S:g} s (got {row[-1].strip()})")
    if not wrong:
        lists[flow].append(delay_s)
    return wrong


def _missing(lists: list[list[float]], names: _Names) -> list[str]:
    empty = [flow for flow, delays_s in enumerate(lists) if not delays_s]
    if not empty:
        return []
    if len(lists) == 1:
        return ["there is no delay in it"]
    more = f" and {len(empty) - 1} more paths" if len(empty) > 1 else ""
    return [f"there is no delay of the path from {names.of(empty[0])}{more}"]

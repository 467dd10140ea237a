"""Finds a packet in a result, has its network repeated, and checks that against the tables."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tieline.cosim.interfaces import Clock
from tieline.errors import CosimError, InputError
from tieline.experiment.results import Run, read_manifest
from tieline.network.engine import DELIVERED
from tieline.network.fate import ENDINGS, Fate
from tieline.problems import near
from tieline.units import NS_PER_S, ns_to_seconds


@dataclass(frozen=True)
class Asked:
    """Which packet: PMU (name or bus), controller (name or unit), and the frame.

    The frame by its number, or by an instant in ns: then it is the last one measured up to it.
    """

    source: str
    destination: str
    sequence: int | None = None
    sent_ns: int | None = None


@dataclass(frozen=True)
class Found:
    """The fate of a packet, and what the result's tables say of it."""

    fate: Fate
    bus: int
    unit: str
    checks: tuple[str, ...]
    remark: str | None = None


class FatesDifferError(CosimError):
    """The repeated network did not do what the result recorded."""


def packet_fate(folder: Path, asked: Asked) -> Found:
    """Return what became of one packet of a run, from its run file, its manifest and the topology.

    Raises:
        InputError: there is no such run or packet, its frames do not cross a network, it cannot be
            repeated, or a file that it read has changed.
        FatesDifferError: a table of the result says otherwise.
    """
    manifest = read_manifest(folder)
    if manifest["kind"] != "run":
        raise InputError(f"{folder} is a sweep: name one of its points, such as {_a_point(folder)}")
    told = Run(folder, manifest).told()
    if told["wams"]["reporting"] == "continuous":
        raise InputError(f"{folder}: with wams.reporting continuous no frame crosses the network")
    source = _place(asked.source, told["sources"], "bus", "B", "--from")
    destination = _place(asked.destination, told["destinations"], "unit", "", "--to")
    sequence = _sequence(asked, Clock(**told["clock"]))
    _check_inputs(told, manifest["inputs"])
    flow = source * len(told["destinations"]) + destination
    flows = Run(folder, manifest).table("flows")
    if len(flows) and sequence >= int(flows["sent"][flow]):
        raise InputError(f"frame {sequence} was never sent: the run ended before")
    # The compiled engine is not loaded for a question that has no answer.
    from tieline.network.replay import replay

    fate = replay(told, source, destination, sequence)
    checks = [_check_packets(fate, flow, folder), _check_flow(fate, flow, flows)]
    remark = None
    if told["network"]["engine"] == "ns3":
        remark = "repeated by the packet engine, which gives each packet the fate that ns-3 does"
    return Found(
        fate,
        told["sources"][source]["bus"],
        told["destinations"][destination]["unit"],
        tuple(text for text in checks if text),
        remark,
    )


def _a_point(folder: Path) -> str:
    return str(next(iter(sorted((folder / "points").glob("*/"))), folder / "points" / "NAME"))


def _place(
    given: str, sites: Sequence[Mapping[str, Any]], key: str, prefix: str, option: str
) -> int:
    """Return the number of a site given by its name, its bus or its unit."""
    known = {f"{prefix}{site[key]}": number for number, site in enumerate(sites)}
    numbers = {str(site[key]): number for number, site in enumerate(sites)}
    names = {site["name"]: number for number, site in enumerate(sites)}
    for table in (names, known, numbers):
        if given in table:
            return int(table[given])
    raise InputError(f"{option} {given!r}: no such site{near(given, [*known, *names])}")


def _sequence(asked: Asked, clock: Clock) -> int:
    """Return the number of the frame asked for."""
    if (asked.sequence is None) == (asked.sent_ns is None):
        raise InputError("say which frame, with --sequence or with --sent-at")
    number = asked.sequence
    if asked.sent_ns is not None:
        number = asked.sent_ns * clock.rate_hz // NS_PER_S
        number += clock.at_ns(number + 1) <= asked.sent_ns
    assert number is not None
    if not 0 <= number < clock.intervals:
        last_s = ns_to_seconds(clock.at_ns(clock.intervals - 1))
        raise InputError(
            f"the frames are 0 to {clock.intervals - 1}, measured from 0 to {last_s:g} s"
            f" (got {number})"
        )
    return number


def _check_inputs(told: Mapping[str, Any], hashes: Mapping[str, str]) -> None:
    """Raise InputError if a file that decides over packets is gone or has changed since the run."""
    trace = (told["network"]["empirical"] or {}).get("trace")
    for name, path in (("topology", told["network"]["topology"]), ("trace", trace)):
        if path is None or name not in hashes:
            continue
        try:
            found = hashlib.sha256(Path(path).read_bytes()).hexdigest()
        except OSError as error:
            raise InputError(f"the run's {name} {path} cannot be read: {error.strerror}") from error
        if found != hashes[name]:
            raise InputError(
                f"the run's {name} {path} has changed since: its SHA-256 was {hashes[name]}"
            )


def _check_packets(fate: Fate, flow: int, folder: Path) -> str | None:
    """Return that packets.parquet says the same; None if it was not recorded.

    Raises:
        FatesDifferError: it does not.
    """
    path = folder / "packets.parquet"
    if not path.is_file():
        return None
    import pyarrow.parquet as pq

    is_it = [("flow", "=", flow), ("sequence", "=", fate.sequence)]
    rows = pq.read_table(path, filters=is_it).to_pylist()
    recorded = (rows[0]["outcome"], rows[0]["ended_ns"]) if rows else (None, None)
    if recorded != (fate.outcome, fate.ended_ns):
        raise FatesDifferError(
            f"repeated, packet {fate.sequence} of flow {flow} was {_words(fate.outcome)} at "
            f"{fate.ended_ns} ns, but packets.parquet says {_words(recorded[0])} at "
            f"{recorded[1]} ns: was the result made by this version?"
        )
    return f"packets.parquet says the same: {_words(fate.outcome)}, {fate.ended_ns} ns"


def _check_flow(fate: Fate, flow: int, flows: Any) -> str | None:
    """Return that the flow's statistics leave room for this; None without a table.

    Raises:
        FatesDifferError: they do not.
    """
    if not len(flows):
        return None
    row = flows.iloc[flow]
    if fate.outcome != DELIVERED:
        column = {1: "dropped_queue", 2: "dropped_loss", 3: "dropped_down"}.get(
            -1 if fate.outcome is None else fate.outcome, "in_flight"
        )
        if row[column] < 1:
            raise FatesDifferError(
                f"repeated, the packet was {_words(fate.outcome)}, but flows.parquet counts none"
            )
        return f"flows.parquet counts {row[column]} such packets of this flow"
    assert fate.ended_ns is not None
    delay_s = ns_to_seconds(fate.ended_ns - fate.measured_ns)
    low_s, high_s = float(row["delay_min_s"]), float(row["delay_max_s"])
    # The table holds nanoseconds as float seconds: half a nanosecond is beyond its rounding.
    if not low_s - 5e-10 <= delay_s <= high_s + 5e-10:
        raise FatesDifferError(
            f"repeated, the packet took {delay_s:.9f} s, but flows.parquet has {low_s:.9f} to "
            f"{high_s:.9f} s"
        )
    return f"flows.parquet: its delay lies within the flow's {low_s:.6f} to {high_s:.6f} s"


def _words(outcome: int | None) -> str:
    return "under way at the end" if outcome is None else ENDINGS[outcome]

"""Says what became of a packet, in words and a table."""

from collections.abc import Iterator

from rich.console import Console
from rich.table import Table

from tieline.fates.lookup import Found
from tieline.network.engine import DELIVERED
from tieline.network.fate import ENDINGS, Draw, Fate, Hop
from tieline.units import ns_to_seconds

_NS_PER_MS = 1_000_000

_COLUMNS = (
    "link",
    "came s",
    "found",
    "wait ms",
    "serial. ms",
    "propag. ms",
    "jitter ms",
    "ended s",
)


def show(found: Found, console: Console) -> None:
    """Print what became of a packet, hop by hop."""
    fate = found.fate
    console.print(
        f"frame {fate.sequence} of {fate.source} (bus {found.bus}) to {fate.destination} "
        f"({found.unit}), {fate.transport}: [bold]{_ending(fate)}[/bold]"
    )
    for line in _begin(fate):
        console.print(line, highlight=False, soft_wrap=True)
    if fate.hops:
        console.print("over each link, in ms (came and over: after the measurement):")
        # Figures that are cut off would be worse than lines that are too long.
        wide = Console(file=console.file, width=max(console.width, 120))
        wide.print(_table(fate))
    for line in [*_notes(fate), *_end(found)]:
        console.print(line, highlight=False, soft_wrap=True)


def _ending(fate: Fate) -> str:
    if fate.outcome is None or fate.ended_ns is None:
        return "under way when the run ended"
    delay = f"{_ms(fate.ended_ns - fate.measured_ns)} ms after its measurement"
    where = f" {fate.hops[-1].origin}->{fate.hops[-1].target}" if fate.hops else ""
    if fate.outcome == DELIVERED:
        return f"delivered, usable {delay}"
    return f"{ENDINGS[fate.outcome]}{where}, {delay}"


def _begin(fate: Fate) -> Iterator[str]:
    yield f"measured at {_s(fate.measured_ns)} s"
    if fate.left_ns is not None:
        took = _ms(fate.left_ns - fate.measured_ns)
        yield f"left its PMU at {_s(fate.left_ns)} s, after {took} ms{_by(fate.pmu_jitter)}"
    for draw in fate.draws:
        yield f"decided by {_draw(draw)}"


def _table(fate: Fate) -> Table:
    """Return a row a link; times in ms after the measurement, to the nanosecond."""
    table = Table(box=None, pad_edge=False)
    table.add_column("link", no_wrap=True)
    columns = ["came", "found waiting", "wait", "serialised", "propagated", "jitter", "over"]
    has_jitter = any(hop.jitter_ns for hop in fate.hops)
    columns = [name for name in columns if name != "jitter" or has_jitter]
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    for hop in fate.hops:
        parts = [hop.wait_ns, hop.service_ns, hop.propagation_ns]
        parts += [hop.jitter_ns] if has_jitter else []
        is_sent = hop.starts_ns is not None
        timed = [_ms(ns) if is_sent and ns is not None else "-" for ns in parts]
        over = "-" if hop.reaches_ns is None else _ms(hop.reaches_ns - fate.measured_ns)
        came = _ms(hop.came_ns - fate.measured_ns)
        table.add_row(f"{hop.origin}->{hop.target}", came, _found(hop), *timed, over)
    return table


def _found(hop: Hop) -> str:
    if not hop.waiting_packets:
        return "0, busy" if hop.is_busy else "0"
    return f"{hop.waiting_packets}, {hop.waiting_bytes} B"


def _notes(fate: Fate) -> Iterator[str]:
    for hop in fate.hops:
        name = f"{hop.origin}->{hop.target}"
        if hop.jitter is not None:
            yield f"{name}: jitter{_by(hop.jitter)}"
        if hop.early is not None:
            yield f"{name}: early detection drew {hop.early.value:.6f}{_by(hop.early)}"
        if hop.dropped is not None:
            yield f"{name}: not carried, {hop.dropped}"
        if hop.lost is not None:
            yield f"{name}: lost where {_draw(hop.lost)}, a gap between losses, ended"


def _end(found: Found) -> Iterator[str]:
    fate = found.fate
    if fate.outcome == DELIVERED and fate.processing_ns:
        took = _ms(fate.processing_ns)
        yield f"its controller took {took} ms for it{_by(fate.controller_jitter)}"
    for remark in (fate.remark, found.remark):
        if remark is not None:
            yield remark
    yield from (f"checked: {text}" for text in found.checks)
    if not found.checks:
        yield "not checked: the result has neither packets.parquet nor flows.parquet"


def _by(draw: Draw | None) -> str:
    return "" if draw is None else f" ({_draw(draw)})"


def _draw(draw: Draw) -> str:
    return f"number {draw.number} of stream '{draw.stream}'"


def _s(ns: int) -> str:
    return f"{ns_to_seconds(ns):.9f}"


def _ms(ns: int) -> str:
    return f"{ns / _NS_PER_MS:.6f}"

"""Writes a topology in tieline's YAML format, one line for each node, link and cross flow."""

import re
import textwrap
from pathlib import Path

from tieline.errors import InputError
from tieline.network.spec import Node
from tieline.network.topologies.draft import US, Draft, DraftCross, DraftLink, LinkDefaults

DEVICES = """\
pmu: {processing: 88 ms, jitter: {distribution: uniform, low: 0 ms, high: 1 ms}}
controller: {processing: 7 ms, jitter: {distribution: uniform, low: 0 ms, high: 1 ms}}
"""
"""An M-class estimator at 60 frames/s, which IEEE C37.118.1 lets take 117 ms, and a controller that
runs every few milliseconds; the figures that cases/miniwecc/network.yaml explains."""

ABOUT_DEVICES = (
    "pmu and controller: processing times chosen as in cases/miniwecc/network.yaml, where they "
    "are explained."
)

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
_NOT_TEXT = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}
_SCALES = ((1_000_000_000, "Gbit/s"), (1_000_000, "Mbit/s"), (1_000, "kbit/s"), (1, "bit/s"))


def as_yaml(draft: Draft) -> str:
    """Return a topology as text that `read_topology` accepts."""
    parts = [
        *_head((*draft.made_by, ABOUT_DEVICES)),
        "",
        f"link_defaults: {_defaults(draft.defaults)}",
        DEVICES,
        "nodes:",
        *(_node(node) for node in draft.nodes),
        "",
        "links:" if draft.links else "links: []",
        *(_link(link) for link in draft.links),
    ]
    if draft.cross:
        parts += ["", "cross_traffic:", *(_cross(flow) for flow in draft.cross)]
    return "\n".join(parts) + "\n"


def write_draft(draft: Draft, path: Path, overwrite: bool = False) -> None:
    """Write a topology file.

    Raises:
        InputError: the file is there already and shall not be overwritten, or cannot be written.
    """
    if path.exists() and not overwrite:
        raise InputError(f"-o {path}: is there already; --force overwrites it")
    try:
        path.write_text(as_yaml(draft), encoding="utf-8")
    except OSError as error:
        raise InputError(f"-o {path}: cannot be written ({error.strerror})") from error


def as_rate(rate_bps: int) -> str:
    """Return a rate in the largest unit that keeps it exact with two decimals at most."""
    for scale, unit in _SCALES:
        if rate_bps >= scale and rate_bps * 100 % scale == 0:
            return f"{rate_bps / scale:.2f}".rstrip("0").rstrip(".") + f" {unit}"
    return f"{rate_bps} bit/s"


def as_name(name: str) -> str:
    """Return a node's name as YAML that reads back as this very text."""
    if _PLAIN.fullmatch(name) and name.lower() not in _NOT_TEXT:
        return name
    return f'"{"".join(_escaped(character) for character in name)}"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return f"\\{character}"
    return character if character.isprintable() else f"\\U{ord(character):08x}"


def _head(sentences: tuple[str, ...]) -> list[str]:
    lines = []
    for sentence in sentences:
        # Names from elsewhere may hold any character; a line break would end the comment.
        words = " ".join(sentence.split())
        lines += textwrap.wrap(words, 100, initial_indent="# ", subsequent_indent="#   ")
    return [line.encode("ascii", "replace").decode() for line in lines]


def _defaults(defaults: LinkDefaults) -> str:
    return (
        f"{{rate: {as_rate(defaults.rate_bps)}, queue: {defaults.queue}, loss: 0, "
        f"overhead: {defaults.overhead_bytes}}}"
    )


def _node(node: Node) -> str:
    keys = [f"buses: [{', '.join(map(str, node.buses))}]"] if node.buses else []
    if node.x is not None and node.y is not None:
        keys += [f"x: {node.x:g}", f"y: {node.y:g}"]
    return f"  {as_name(node.name)}:" + (f" {{{', '.join(keys)}}}" if keys else "")


def _link(link: DraftLink) -> str:
    keys = [f"a: {as_name(link.a)}", f"b: {as_name(link.b)}"]
    if link.rate_bps is not None:
        keys.append(f"rate: {as_rate(link.rate_bps)}")
    keys.append(f"propagation: {link.propagation_ns / (1000 * US):.6f}".rstrip("0").rstrip("."))
    text = f"  - {{{', '.join(keys)} ms}}"
    if link.km is not None:
        text += f"  # {link.km:.0f} km"
    if link.km is not None and link.through:
        text += f" by {', '.join(link.through)}"
    return text


def _cross(flow: DraftCross) -> str:
    return (
        f"  - {{kind: {flow.kind}, from: {as_name(flow.origin)}, to: {as_name(flow.target)}, "
        f"rate: {as_rate(flow.rate_bps)}, payload: {flow.payload_bytes}}}"
    )

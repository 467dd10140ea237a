"""Result folders and captures that somebody else may have made: read, or refused."""

import functools
import json

from fuzz.script import Script, edited, edited_text, edited_tree, scratch
from tieline.errors import InputError
from tieline.experiment.results import is_result, read_runs
from tieline.network.pcap.reader import read_pcap

MANIFEST = {
    "format": "tieline-result/1", "kind": "run", "status": "complete", "reason": None,
    "name": "a", "label": "", "config": {"grid": {"events": [{"trip_generator": "G1"}]}},
    "tables": {"grid.parquet": "00"}, "granted_ns": {"grid": 1},
}  # fmt: skip
SWEEP = {
    "format": "tieline-result/1", "kind": "sweep", "status": "complete", "reason": None,
    "name": "a", "points": [{"label": "x", "slug": "x", "settings": {}}],
}  # fmt: skip


def one_input(data: bytes) -> None:
    """Read what an input makes of a manifest or of a capture."""
    script = Script(data)
    try:
        _manifest(script) if script.below(2) else _capture(script)
    except InputError as error:
        assert error.findings, "an error without a finding"


def _manifest(script: Script) -> None:
    folder = scratch() / "result"
    folder.mkdir(exist_ok=True)
    manner, whole = script.below(4), script.one([MANIFEST, SWEEP])
    if manner == 0:
        content = script.rest()
    elif manner == 1:
        content = edited_text(json.dumps(whole), script)
    else:
        content = _as_json(edited_tree(json.loads(json.dumps(whole)), script))
    (folder / "manifest.json").write_bytes(content)
    is_result(folder)
    for run in read_runs(folder):
        assert isinstance(run.label, str)
        assert isinstance(run.is_complete, bool)


def _as_json(tree: object) -> bytes:
    try:
        return json.dumps(tree, skipkeys=True).encode()
    except ValueError:
        # A tree within itself.
        return b"[]"


def _capture(script: Script) -> None:
    path = scratch() / "capture.pcap"
    path.write_bytes(script.rest() if script.below(4) == 0 else edited(_pcap(), script))
    trace = read_pcap(path)
    assert (trace.sizes_bytes >= 0).all()
    assert (trace.times_ns >= 0).all()


@functools.cache
def _pcap() -> bytes:
    """Return a capture of three packets on Ethernet: IPv4, tagged IPv6, ARP."""
    head = bytes.fromhex("d4c3b2a1020004000000000000000000ffff000001000000")
    ethernet = bytes(12)
    packets = [
        ethernet + b"\x08\x00" + b"\x45\x00\x00\x2e" + bytes(42),
        ethernet + b"\x81\x00\x00\x05\x86\xdd" + b"\x60\x00\x00\x00\x00\x08" + bytes(42),
        ethernet + b"\x08\x06" + bytes(28),
    ]
    records = b""
    for second, packet in enumerate(packets):
        size = len(packet).to_bytes(4, "little")
        records += second.to_bytes(4, "little") + bytes(4) + size + size + packet
    return head + records

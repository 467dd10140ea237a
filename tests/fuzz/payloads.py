"""What comes over HELICS: parts of bundles, bundles, end markers, signals of guests."""

import functools

import numpy as np

from fuzz.script import Script, edited
from tieline.cosim.guests import read_command
from tieline.cosim.interfaces import DELIVERY, DeliveryBundle, FrameBundle
from tieline.cosim.wire import Kind, Ledger, join, read_part, split
from tieline.errors import CosimError, NumericalError


def one_input(data: bytes) -> None:
    """Read what an input makes of a message."""
    script = Script(data)
    reader = script.one([_parts, _frames, _deliveries, _end, _signal])
    try:
        reader(script)
    except (CosimError, NumericalError) as error:
        assert len(str(error)) < 2_000


def _parts(script: Script) -> None:
    limit = script.one([None, 40, 200])
    messages = split(Kind(script.below(2)), script.below(100), _bundle(), limit)
    spoilt = [edited(message, script) if script.below(3) else message for message in messages]
    join([read_part(message) for message in spoilt])


def _frames(script: Script) -> None:
    whole = FrameBundle(16_666_666, np.arange(68, dtype=np.uint8).reshape(2, 34)).to_bytes()
    message = script.rest() if script.below(6) == 0 else edited(whole, script)
    bundle = FrameBundle.from_bytes(message)
    assert bundle.to_bytes() == message


def _deliveries(script: Script) -> None:
    message = script.rest() if script.below(6) == 0 else edited(_bundle(), script)
    bundle = DeliveryBundle.from_bytes(message)
    assert bundle.to_bytes() == message
    assert (bundle.records["payload"] < len(bundle.payloads)).all()


def _end(script: Script) -> None:
    ledger = Ledger()
    ledger.add(b"x")
    ledger.check(edited(ledger.to_bytes(), script), "network")


def _signal(script: Script) -> None:
    text = script.rest() if script.below(3) == 0 else edited(b"0.0125", script)
    command = read_command("damper/G2", 300, text)
    assert np.isfinite(command.v_s_pu)


@functools.cache
def _bundle() -> bytes:
    records = np.zeros(3, DELIVERY)
    records["arrival_ns"] = (16_700_000, 16_700_000, 33_000_000)
    records["source"], records["destination"] = (0, 1, 1), (0, 0, 1)
    records["sequence"], records["payload"] = (1, 1, 1), (0, 1, 1)
    payloads = np.arange(68, dtype=np.uint8).reshape(2, 34)
    return DeliveryBundle(33_333_333, records, payloads).to_bytes()

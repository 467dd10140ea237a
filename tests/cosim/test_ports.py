"""Each run has ports of its own."""

import socket

import pytest

from tieline.cosim import ports
from tieline.cosim.ports import reserved_port
from tieline.errors import CosimError


def test_blocks_reserved_at_once_never_meet() -> None:
    """If not, two runs at once would talk to each other's broker."""
    with reserved_port() as first, reserved_port() as second, reserved_port() as third:
        assert len({first, second, third}) == 3
        assert all(port % 100 == 0 and 10_000 <= port < 32_768 for port in (first, second, third))


def test_a_block_is_free_again_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    """If not, a long sweep would run out of ports."""
    with reserved_port() as first:
        pass
    monkeypatch.setattr(ports, "_BLOCKS", range(first, first + 100, 100))
    with reserved_port() as again:
        assert again == first


def test_a_block_with_a_port_in_use_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """If not, the broker could not listen where it is told to."""
    with reserved_port() as first, socket.socket() as other:
        other.bind(("127.0.0.1", first + 5))
    with socket.socket() as other:
        other.bind(("127.0.0.1", first + 5))
        monkeypatch.setattr(ports, "_BLOCKS", range(first, first + 100, 100))
        with pytest.raises(CosimError, match="no free block of ports"), reserved_port():
            pass

"""A switch in user space whose lines delay: `line.py DELAY_MS NAMESPACE...`, ended by SIGTERM.

Each namespace gets a TAP device `eth0`; a frame from one comes out of all others after the delay.
"""

import ctypes
import fcntl
import heapq
import os
import select
import signal
import struct
import sys
import time
from pathlib import Path

_TUNSETIFF = 0x400454CA
_IFF_TAP, _IFF_NO_PI = 0x0002, 0x1000
_CLONE_NEWNET = 0x40000000
_LONGEST_FRAME = 65_536


def open_tap(namespace: str) -> int:
    """Return the descriptor of a new device `eth0` in a namespace."""
    own = os.open("/proc/self/ns/net", os.O_RDONLY)
    other = os.open(Path("/run/netns") / namespace, os.O_RDONLY)
    libc = ctypes.CDLL(None, use_errno=True)
    try:
        if libc.setns(other, _CLONE_NEWNET):
            raise OSError(ctypes.get_errno(), f"cannot enter {namespace}")
        tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(tap, _TUNSETIFF, struct.pack("16sH", b"eth0", _IFF_TAP | _IFF_NO_PI))
        return tap
    finally:
        libc.setns(own, _CLONE_NEWNET)
        os.close(own)
        os.close(other)


def switch(taps: list[int], delay_s: float) -> None:
    """Pass frames on, for ever."""
    held: list[tuple[float, int, int, bytes]] = []
    count = 0
    while True:
        wait_s = None if not held else max(0.0, held[0][0] - time.monotonic())
        for tap in select.select(taps, [], [], wait_s)[0]:
            frame = os.read(tap, _LONGEST_FRAME)
            count += 1
            heapq.heappush(held, (time.monotonic() + delay_s, count, tap, frame))
        while held and held[0][0] <= time.monotonic():
            _, _, source, frame = heapq.heappop(held)
            for tap in taps:
                if tap != source:
                    give(tap, frame)


def give(tap: int, frame: bytes) -> None:
    """Write a frame to a device; one that is down or full loses it, as a line would."""
    try:
        os.write(tap, frame)
    except OSError:
        return


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    delay_ms, *namespaces = sys.argv[1:]
    devices = [open_tap(namespace) for namespace in namespaces]
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    switch(devices, float(delay_ms) / 1e3)

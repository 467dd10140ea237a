"""Hosts of one's own: network namespaces, each with one address, joined by lines with a delay.

With the kernel's `netem` the hosts hang by veth pairs on a bridge, and each line's both ends hold
every frame back. A kernel without it has TAP devices and `line.py`, a switch in user space that
does the same.
"""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

LINE = Path(__file__).with_name("line.py")
NETWORK = "10.213.77"
_READY_S = 10.0


def why_not() -> str | None:
    """Return why this process may make no network namespaces; None if it may."""
    if os.name != "posix" or shutil.which("ip") is None or shutil.which("tc") is None:
        return "network namespaces need Linux with ip and tc (package iproute2)"
    name = f"tieline-probe-{os.getpid()}"
    made = _try("ip", "netns", "add", name)
    if made.returncode:
        return f"network namespaces are not permitted here: {made.stderr.strip()}"
    _try("ip", "netns", "del", name)
    return None


@contextmanager
def hosts(names: Sequence[str], delay_ms: float) -> Iterator[Mapping[str, str]]:
    """Make namespaces that see each other over lines of `delay_ms` each way; give their addresses.

    The address of the namespace `names[i]` is given under that name. All are gone afterwards.
    """
    prefix = f"tl{os.getpid()}"
    with ExitStack() as stack:
        inside = {name: _namespace(stack, f"{prefix}-{name}") for name in names}
        addresses = {name: f"{NETWORK}.{i}" for i, name in enumerate(names, 1)}
        if _has_netem(next(iter(inside.values()))):
            _join_by_veth(stack, prefix, inside, delay_ms)
        else:
            _join_by_tap(stack, inside, delay_ms)
        for name, namespace in inside.items():
            _ip(namespace, "addr", "add", f"{addresses[name]}/24", "dev", "eth0")
            _ip(namespace, "link", "set", "eth0", "up")
        yield addresses


def command_in(name: str, *command: str) -> list[str]:
    """Return a command that runs in the namespace that `hosts` calls `name`."""
    return ["ip", "netns", "exec", f"tl{os.getpid()}-{name}", *command]


def _namespace(stack: ExitStack, name: str) -> str:
    _run("ip", "netns", "add", name)
    stack.callback(_try, "ip", "netns", "del", name)
    _ip(name, "link", "set", "lo", "up")
    return name


def _has_netem(namespace: str) -> bool:
    netem = ("qdisc", "add", "dev", "lo", "root", "netem", "delay", "1ms")
    if _try("ip", "netns", "exec", namespace, "tc", *netem).returncode:
        return False
    _run("ip", "netns", "exec", namespace, "tc", "qdisc", "del", "dev", "lo", "root")
    return True


def _join_by_veth(
    stack: ExitStack, prefix: str, inside: Mapping[str, str], delay_ms: float
) -> None:
    hub = _namespace(stack, f"{prefix}-hub")
    _ip(hub, "link", "add", "bridge", "type", "bridge")
    _ip(hub, "link", "set", "bridge", "up")
    for i, namespace in enumerate(inside.values()):
        port = f"port{i}"
        pair = ("link", "add", "eth0", "type", "veth", "peer", "name", port, "netns", hub)
        _ip(namespace, *pair)
        _ip(hub, "link", "set", port, "master", "bridge", "up")
        # Half at each end, so that a frame from one host to another is held back once in all.
        netem = ("root", "netem", "delay", f"{delay_ms / 2}ms")
        _run("ip", "netns", "exec", namespace, "tc", "qdisc", "add", "dev", "eth0", *netem)
        _run("ip", "netns", "exec", hub, "tc", "qdisc", "add", "dev", port, *netem)


def _join_by_tap(stack: ExitStack, inside: Mapping[str, str], delay_ms: float) -> None:
    command = [sys.executable, str(LINE), str(delay_ms), *inside.values()]
    switch = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    stack.callback(_end, switch)
    assert switch.stdout is not None
    if switch.stdout.readline() != "ready\n":
        raise RuntimeError("the lines between the hosts could not be made")


def _end(process: "subprocess.Popen[str]") -> None:
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=_READY_S)


def _ip(namespace: str, *words: str) -> None:
    _run("ip", "-n", namespace, *words)


def _run(*command: str) -> None:
    done = _try(*command)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")


def _try(*command: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)

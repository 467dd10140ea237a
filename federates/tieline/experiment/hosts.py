"""One run on several hosts: the broker's side, and that of each federate."""

import select
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

from tieline.cosim.interfaces import FEDERATES, FederationSettings
from tieline.cosim.runfile import federation_of
from tieline.errors import CosimError, InputError
from tieline.experiment.desk import Message, Wire, connect, listen
from tieline.experiment.door import Door, introduce
from tieline.experiment.export import check_empty, lay_out
from tieline.experiment.interrupts import interruptible
from tieline.experiment.keys import KEY_VARIABLE
from tieline.experiment.launch import (
    BROKER,
    COMMANDS,
    Outcome,
    Processes,
)
from tieline.experiment.plan import PlannedRun
from tieline.experiment.remote import Remote, Uplink
from tieline.experiment.watch import Progress, Suspect, Watch

Say = Callable[[str], None]

_OVER_S = 3600.0
"""The other side may have much to write; a broker that dies is noticed at once all the same."""
_PATIENCE = 20.0
"""How much longer a single federate waits than the broker, which hears both and ends a run."""


def check_address(host: str, allow_remote: bool) -> None:
    """Refuse an address that lets others in, unless that is wanted.

    Raises:
        InputError: it is no loopback address and `allow_remote` is not given, or it is none at all.
    """
    if host in ("", "0.0.0.0", "::"):
        raise InputError(f"{host or 'nothing'} is no address at which other hosts reach this one")
    if not is_loopback(host) and not allow_remote:
        raise InputError(
            f"{host} is not this computer alone: nothing that HELICS or tieline sends there is"
            " encrypted, so give --allow-remote only in a network that you trust, or in a tunnel"
        )


def is_loopback(host: str) -> bool:
    """Return whether only this computer reaches an address."""
    return host == "localhost" or host.startswith("127.")


def check_key(host: str, key: str | None) -> None:
    """Refuse an address that others can reach without a key.

    Raises:
        InputError: it is one, and there is none.
    """
    if key is None and not is_loopback(host):
        raise InputError(
            f"a broker at {host} needs a key: set {KEY_VARIABLE} or give --key-file, with what"
            " `tieline broker` shows when it makes one"
        )


def serve(
    planned: PlannedRun,
    host: str,
    port: int,
    wait_s: float,
    say: Say,
    on_progress: Callable[[Progress], None] | None = None,
    key: str | None = None,
) -> Outcome:
    """Run the broker of one run, and return how it went once every federate has left.

    Args:
        planned: the run.
        host: address of this host.
        port: where federates knock; HELICS gets the one after it.
        wait_s: longest wait until all have come.
        say: is told who comes.
        on_progress: is told how far they are.
        key: what federates must have; may be None on this computer alone.

    Raises:
        InputError: there is no key, it cannot listen there, or the core is not for processes.
        CosimError: not all came in time.
        FederateFailedError: a federate or the broker died, failed or hung.
    """
    settings = _settings(planned)
    check_key(host, key)
    door = Door(planned, key, say)
    with interruptible(), ExitStack() as stack:
        wires = _admit(door, host, port, wait_s, say)
        for wire in wires.values():
            stack.callback(wire.close)
        remotes = [Remote(name, wires[name]) for name in FEDERATES]
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="tieline-broker-"))
        processes = Processes(
            Path(folder),
            Watch(settings),
            on_progress,
            remotes=remotes,
            on_fault=lambda at_fault: _tell_all(remotes, {"end": _sentence(at_fault)}),
            key=door.helics_key,
        )
        _tell_all(remotes, {"go": port + 1})
        place = [settings.core, str(port + 1), f"--host={host}"]
        outcome = processes.run([(BROKER, [*COMMANDS[BROKER], *place])])
        _tell_all(remotes, {"over": True})
        return outcome


def join(
    planned: PlannedRun,
    federate: str,
    broker: tuple[str, int],
    folder: Path,
    wait_s: float,
    say: Say,
    commands: Mapping[str, Sequence[str]] = COMMANDS,
    key: str | None = None,
) -> Outcome:
    """Run one federate of a run whose broker is elsewhere, and return how it went.

    Args:
        planned: the run, the same as at the broker.
        federate: `grid` or `network`.
        broker: its address and port.
        folder: where the tables go; new or empty.
        wait_s: longest wait for the broker and for the others.
        say: is told what is waited for.
        commands: what starts a federate.
        key: the broker's; may be None on this computer alone.

    Raises:
        InputError: the folder is not empty.
        RefusedError: the broker runs something else, which the message names, or has another key.
        CosimError: there is no broker.
        FederateFailedError: this federate, the broker or another one failed.
    """
    settings = _settings(planned)
    check_key(broker[0], key)
    check_empty(folder)
    with interruptible(), closing(connect(*broker, wait_s)) as wire:
        helics_key = introduce(wire, planned, federate, key)
        port = _await_others(wire, federate, wait_s, say)
        place = {"broker_host": wire.other_address, "interface": wire.own_address}
        lay_out(planned, folder, broker_port=port, **place)
        uplink = Uplink(wire)
        processes = Processes(
            folder,
            Watch(_patient(settings), members=(federate,), bystanders=(BROKER,)),
            None,
            remotes=[uplink],
            on_fault=uplink.end,
            on_word=uplink.hear,
            key=helics_key,
            name=f"launcher_of_{federate}",
        )
        outcome = processes.run([(federate, [*commands[federate], str(folder / "run.json")])])
        _leave(wire)
        return outcome


def _patient(settings: FederationSettings) -> FederationSettings:
    longer = {
        name: _PATIENCE * getattr(settings, name) for name in ("hang_timeout", "start_timeout")
    }
    return settings.model_copy(update=longer)


def _settings(planned: PlannedRun) -> FederationSettings:
    settings, _ = federation_of(planned.run)
    if settings.core not in ("zmq", "tcp"):
        raise InputError(f"several hosts need federation.core zmq or tcp (got {settings.core})")
    if settings.guests:
        raise InputError(
            "federation.guests cannot join a run on several hosts yet: use tieline run"
        )
    return settings


def _admit(door: Door, host: str, port: int, wait_s: float, say: Say) -> dict[str, Wire]:
    """Return a connection to each federate, once all that may join have come."""
    wires: dict[str, Wire] = {}
    limit = time.monotonic() + wait_s
    with listen(host, port) as listener:
        say(f"waiting for {' and '.join(FEDERATES)} at {host}:{port}")
        while len(wires) < len(FEDERATES):
            if time.monotonic() > limit:
                missing = " and ".join(name for name in FEDERATES if name not in wires)
                raise CosimError(f"{missing} did not come in {wait_s:g} s")
            if select.select([listener], [], [], 0.2)[0]:
                wire = Wire(listener.accept()[0])
                name = door.examined(wire, wires)
                if name is not None:
                    wires[name] = wire
            for name in [name for name, wire in wires.items() if not _is_there(wire)]:
                say(f"{name} went away")
                wires.pop(name).close()
    return wires


def _is_there(wire: Wire) -> bool:
    wire.keep_alive()
    for _ in wire.read():
        continue
    return wire.lost is None


def _await_others(wire: Wire, federate: str, wait_s: float, say: Say) -> int:
    """Return HELICS's port at the broker, once everybody has come."""
    say(f"{federate} joined the broker at {wire.other_address}, and waits for the others")
    answer = wire.wait(wait_s)
    if "go" not in answer:
        raise CosimError(f"the broker at {wire.other_address} gave up: {answer}")
    return int(answer["go"])


def _tell_all(remotes: Sequence[Remote], message: Message) -> None:
    for remote in remotes:
        remote.tell(message)


def _sentence(suspect: Suspect) -> str:
    # Whoever hears it from the broker shows its name in front.
    return suspect.reason if suspect.name == BROKER else f"{suspect.name}: {suspect.reason}"


def _leave(wire: Wire) -> None:
    """Tell the broker that all went well here, and wait until it did everywhere."""
    wire.send({"done": 0})
    answer = wire.wait(_OVER_S)
    if "over" not in answer:
        raise CosimError(f"the run did not end well elsewhere: {answer.get('end', answer)}")

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
from tieline.experiment.desk import Message, Wire, connect, hello, listen, refusal
from tieline.experiment.export import check_empty, lay_out
from tieline.experiment.interrupts import interruptible
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

_HELLO_S = 2.0
"""Who connects says hello at once; meanwhile those who have joined hear nothing."""
_ANSWER_S = 5.0
_OVER_S = 3600.0
"""The other side may have much to write; a broker that dies is noticed at once all the same."""
_PATIENCE = 20.0
"""How much longer a single federate waits than the broker, which hears both and ends a run."""


class RefusedError(InputError):
    """The broker runs another experiment, or another release."""


def check_address(host: str, allow_remote: bool) -> None:
    """Refuse an address that lets others in, unless that is wanted.

    Raises:
        InputError: it is no loopback address and `allow_remote` is not given, or it is none at all.
    """
    if host in ("", "0.0.0.0", "::"):
        raise InputError(f"{host or 'nothing'} is no address at which other hosts reach this one")
    if not (host == "localhost" or host.startswith("127.")) and not allow_remote:
        raise InputError(
            f"{host} is not this computer alone: neither HELICS nor tieline asks who connects, so"
            " give --allow-remote only in a network where you trust everybody"
        )


def serve(
    planned: PlannedRun,
    host: str,
    port: int,
    wait_s: float,
    say: Say,
    on_progress: Callable[[Progress], None] | None = None,
) -> Outcome:
    """Run the broker of one run, and return how it went once every federate has left.

    Args:
        planned: the run.
        host: address of this host.
        port: where federates knock; HELICS gets the one after it.
        wait_s: longest wait until all have come.
        say: is told who comes.
        on_progress: is told how far they are.

    Raises:
        InputError: it cannot listen there, or the core is none for several processes.
        CosimError: not all came in time.
        FederateFailedError: a federate or the broker died, failed or hung.
    """
    settings = _settings(planned)
    with interruptible(), ExitStack() as stack:
        wires = _admit(planned, host, port, wait_s, say)
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

    Raises:
        InputError: the folder is not empty.
        RefusedError: the broker runs something else; the message names both.
        CosimError: there is no broker.
        FederateFailedError: this federate, the broker or another one failed.
    """
    settings = _settings(planned)
    check_empty(folder)
    with interruptible(), closing(connect(*broker, wait_s)) as wire:
        port = _knock(wire, planned, federate, wait_s, say)
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


def _admit(planned: PlannedRun, host: str, port: int, wait_s: float, say: Say) -> dict[str, Wire]:
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
                name = _examined(wire, planned, wires, say)
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


def _examined(wire: Wire, planned: PlannedRun, wires: dict[str, Wire], say: Say) -> str | None:
    """Return the name of a federate that may join; answer it either way."""
    try:
        theirs = wire.wait(_HELLO_S)
    except CosimError as error:
        say(f"somebody at {wire.other_address} said nothing: {error}")
        wire.close()
        return None
    name = str(theirs.get("federate"))
    reason = refusal(hello(planned, name), theirs)
    if name not in FEDERATES:
        reason = f"there is no federate {name!r}"
    elif name in wires:
        reason = f"the {name} has joined already, from {wires[name].other_address}"
    if reason is not None:
        say(f"refused {wire.other_address}: {reason}")
        wire.send({"refused": reason})
        wire.close()
        return None
    say(f"{name} comes from {wire.other_address}")
    wire.send({"accepted": name})
    return name


def _knock(wire: Wire, planned: PlannedRun, federate: str, wait_s: float, say: Say) -> int:
    """Return HELICS's port at the broker, once everybody has come."""
    wire.send(hello(planned, federate))
    answer = wire.wait(_ANSWER_S)
    if "refused" in answer:
        raise RefusedError(f"the broker at {wire.other_address} refused: {answer['refused']}")
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

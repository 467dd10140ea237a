"""`tieline export-helics`, `broker`, `join` and `gather`: federates that tieline does not start."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tieline.cli.options import Debug, Reference, Settings
from tieline.cli.run import planned
from tieline.console import console_of, reporting, say
from tieline.errors import InputError

if TYPE_CHECKING:
    from tieline.experiment.plan import PlannedRun
    from tieline.experiment.sweep_run import Listener
    from tieline.experiment.watch import Progress

PORT = 23_404
"""Where HELICS's own programs look for a broker."""

Port = Annotated[int, typer.Option(min=1024, max=32_000, help="where the broker listens")]
Wait = Annotated[str, typer.Option(metavar="TIME", help="longest wait until all have come")]
AllowRemote = Annotated[
    bool, typer.Option("--allow-remote", help="let an address be one that other hosts can reach")
]
KeyFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="file with the broker's key, for your eyes alone; else TIELINE_BROKER_KEY",
    ),
]
Target = Annotated[Path, typer.Option(metavar="DIR", help="the result folder, new or empty")]


def export_helics(
    reference: Reference,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder for the files; else helics/NAME")
    ] = None,
    port: Port = PORT,
    settings: Settings = None,
    debug: Debug = False,
) -> None:
    """Write a run as HELICS's own runner and federate files, for `helics run`."""
    from tieline.experiment.export import export_helics as export
    from tieline.experiment.export import single_run

    with reporting(debug):
        plan = planned(reference, settings or [])
        folder = out or Path("helics") / plan.study.name
        runner = export(single_run(plan, "export-helics"), folder, port)
        say(f"helics run --path={runner}\ntieline gather {folder} --out RESULT")


def gather(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="folders of one run's federates")
    ],
    out: Target,
    debug: Debug = False,
) -> None:
    """Make one result of what federates have left in folders of their own."""
    from tieline.experiment.gather import gather as gather_folders
    from tieline.experiment.report import report as write_report

    with reporting(debug):
        write_report(gather_folders(folders, out), console_of())


def broker(
    reference: Reference,
    host: Annotated[str, typer.Option(metavar="H", help="address of this host")] = "127.0.0.1",
    port: Port = PORT,
    wait: Wait = "10 min",
    allow_remote: AllowRemote = False,
    key_file: KeyFile = None,
    settings: Settings = None,
    debug: Debug = False,
) -> None:
    """Be the broker of a run whose federates are on other hosts."""
    from tieline.experiment.export import single_run
    from tieline.experiment.hosts import check_address, is_loopback, serve
    from tieline.experiment.keys import KEY_VARIABLE, given_key, new_key
    from tieline.experiment.progress import shown_progress

    with reporting(debug):
        check_address(host, allow_remote)
        plan = planned(reference, settings or [])
        run = single_run(plan, "broker")
        key = given_key(key_file)
        if key is None and not is_loopback(host):
            key = new_key()
            say(
                f"the key of this run, shown once: {key}\n"
                f"on the other hosts, before tieline join: read -rs {KEY_VARIABLE};"
                f" export {KEY_VARIABLE}"
            )
        with shown_progress(plan.study.points, console_of()) as listener:
            outcome = serve(run, host, port, _seconds(wait), say, _of_grid(run, listener), key)
        say(f"both federates reached the end, in {sum(outcome.wall_s.values()):.1f} s")


def join(
    reference: Reference,
    federate: Annotated[str, typer.Option(metavar="grid|network", help="which one runs here")],
    broker: Annotated[str, typer.Option(metavar="H:PORT", help="where the broker listens")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="folder for its tables, new or empty")],
    wait: Wait = "10 min",
    allow_remote: AllowRemote = False,
    key_file: KeyFile = None,
    settings: Settings = None,
    debug: Debug = False,
) -> None:
    """Run the grid or the network of a run whose broker is elsewhere."""
    from tieline.cosim.interfaces import FEDERATES
    from tieline.experiment.export import single_run
    from tieline.experiment.hosts import check_address
    from tieline.experiment.hosts import join as join_run
    from tieline.experiment.keys import given_key

    with reporting(debug):
        host, port = _address(broker)
        check_address(host, allow_remote)
        if federate not in FEDERATES:
            raise InputError(f"--federate must be grid or network (got {federate!r})")
        run = single_run(planned(reference, settings or []), "join")
        key = given_key(key_file)
        join_run(run, federate, (host, port), out, _seconds(wait), say, key=key)
        say(f"the {federate} reached the end; its tables are in {out}")


def _of_grid(run: "PlannedRun", listener: "Listener") -> "Callable[[Progress], None]":
    from tieline.units import ns_to_seconds

    def report(progress: "Progress") -> None:
        if progress.federate == "grid" and listener.on_time is not None:
            listener.on_time(run.point, ns_to_seconds(max(0, progress.granted_ns)))

    return report


def _seconds(text: str) -> float:
    from tieline.units import quantity

    try:
        return quantity(text, "time")
    except ValueError as error:
        raise InputError(f"--wait {error}") from error


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65_536:
        raise InputError(f"--broker must be HOST:PORT, such as 192.0.2.1:{PORT} (got {text!r})")
    return host, int(port)

"""The application: every command by its name."""

import gc
from typing import Annotated

import typer

import tieline
from tieline.cli import (
    compare,
    config,
    doctor,
    federation,
    linear,
    log,
    models,
    packet,
    report,
    reproduce,
    run,
    sweep,
)
from tieline.cli.topology import topology
from tieline.console import say
from tieline.errors import InputError

HELP = """A power grid and the packet network that carries its measurements, simulated together.

`tieline list` shows the experiments that come with it; `tieline run NAME` runs one.
"""

EXIT_CODES = """\b
Exit codes: 0 done and whole; 1 unexpected error; 2 bad input, nothing was started;
3 the mathematics failed (power flow, initial point, a value not finite);
4 the federation failed (a process died, hung or broke the time contract);
130 interrupted. A sweep with failed points ends with the code of the first of them.
"""

app = typer.Typer(help=HELP, epilog=EXIT_CODES, rich_markup_mode=None)


def main() -> None:
    """Run the command line."""
    try:
        app(prog_name="tieline")
    finally:
        # Python would look through all that was imported for garbage: half a second, for nothing.
        gc.freeze()


@app.callback(invoke_without_command=True)
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, help="print the version and end")
    ] = False,
) -> None:
    if version:
        say(f"tieline {tieline.__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        say(context.get_help())
        raise typer.Exit(InputError.exit_code)


for command in (
    run.run,
    sweep.sweep,
    run.list_,
    run.validate,
    compare.compare,
    compare.plot,
    report.report,
    packet.packet,
    models.models,
    config.schema,
    config.show,
    config.new,
    config.cases,
    federation.export_helics,
    federation.broker,
    federation.join,
    federation.gather,
    doctor.doctor,
    log.log,
    linear.modes,
    linear.freqresp,
    linear.damping,
    reproduce.reproduce,
):
    app.command(command.__name__.rstrip("_").replace("_", "-"))(command)
app.add_typer(topology)

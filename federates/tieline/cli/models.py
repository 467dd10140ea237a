"""`tieline models`: the device models with their parameters."""

from typing import Annotated

import typer

from tieline.cli.options import Debug
from tieline.console import reporting, say
from tieline.errors import InputError


def models(
    role: Annotated[
        str | None, typer.Argument(help="machine, exciter, governor or pss; all without it")
    ] = None,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="as the page of the documentation")
    ] = False,
    debug: Debug = False,
) -> None:
    """List the device models: source, states, and each parameter with unit, bounds and meaning."""
    from tieline.grid.models.base import ROLES
    from tieline.grid.models.catalogue import as_markdown, as_text, entries

    with reporting(debug):
        if role is not None and role not in ROLES:
            raise InputError(f"no role '{role}': give one of {', '.join(ROLES)}")
        if markdown:
            say(as_markdown(entries(role)))
            return
        say("\n\n".join(as_text(entry) for entry in entries(role)))

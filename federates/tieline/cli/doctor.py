"""`tieline doctor`: checks the installation, or explains the last run."""

import dataclasses
import json
from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import AsJson, Debug
from tieline.console import console_of, reporting, say
from tieline.errors import InputError, TielineError

COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


def doctor(
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="[FOLDER]", help="with --last: a result, not the newest one"),
    ] = None,
    last: Annotated[
        bool, typer.Option("--last", help="explain the last run of this folder instead")
    ] = False,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Check Python, cores, memory, HELICS, cache, ports and extras, and run a short federation.

    With --last, tell what became of the last run here: if it failed, what happened, who was at
    fault and when, what the others were doing, what usually causes it, what to do, and what can be
    read. The exit code is 0 unless a check fails.
    """
    with reporting(debug):
        if last:
            _explain(folder, as_json)
        elif folder is not None:
            raise InputError(f"{folder}: only --last takes a folder")
        else:
            _check(as_json)


def _explain(folder: Path | None, as_json: bool) -> None:
    from tieline.doctor.last import last_result, story_of
    from tieline.doctor.telling import as_data, told

    story = story_of(folder or last_result(Path()))
    if as_json:
        typer.echo(json.dumps(as_data(story), indent=2, ensure_ascii=False))
    else:
        say(told(story))


def _check(as_json: bool) -> None:
    from rich.text import Text

    from tieline.doctor import CHECKS, examine

    console = console_of(quiet=as_json)
    findings = []
    for finding in examine(CHECKS):
        findings.append(finding)
        line = Text(f"{finding.level:<5}", COLOURS[finding.level])
        line.append(f"{finding.name:<14} {finding.text}", "default")
        console.print(line, soft_wrap=True)
        if finding.advice:
            console.print(Text(f"{'':20}{finding.advice}"), soft_wrap=True)
    failed = any(finding.level == "fail" for finding in findings)
    if as_json:
        data = [dataclasses.asdict(finding) for finding in findings]
        typer.echo(json.dumps({"is_sound": not failed, "checks": data}, indent=2))
    if failed:
        raise typer.Exit(TielineError.exit_code)

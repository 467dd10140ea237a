"""`tieline doctor`: checks the installation."""

import dataclasses
import json

import typer

from tieline.cli.options import AsJson, Debug
from tieline.console import console_of, reporting
from tieline.errors import TielineError

COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


def doctor(as_json: AsJson = False, debug: Debug = False) -> None:
    """Check Python, cores, memory, HELICS, cache, ports and extras, and run a short federation.

    The exit code is 0 unless a check fails.
    """
    from rich.text import Text

    from tieline.doctor import CHECKS, examine

    with reporting(debug):
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

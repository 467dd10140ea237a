"""The command line: every `tieline` command, thin; what it does stands in the packages."""

from tieline.cli.app import app, main

__all__ = ["app", "main"]

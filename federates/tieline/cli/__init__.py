"""The command line: every `tieline` command, thin; what it does stands in the packages."""

import sys

try:
    from tieline.cli.app import app, main
except KeyboardInterrupt:
    # Whoever is quick meets the imports, where no command's own handling is in force.
    sys.stderr.write("interrupted\n")
    raise SystemExit(130) from None

__all__ = ["app", "main"]

"""Runs this checkout's own tieline: `python runner.py run g26_trip`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "federates"))

from tieline.cli import main

main()

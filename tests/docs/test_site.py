"""The documentation as a site, and the pages of it that are made from the code."""

import subprocess
import sys
from pathlib import Path

import pytest

from tieline.cli import reference
from tieline.grid.models.catalogue import as_markdown, entries

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = {
    "cli_reference.md": (reference.as_markdown, "python -m tieline.cli.reference"),
    "models_reference.md": (lambda: as_markdown(entries()) + "\n", "tieline models --markdown"),
}


@pytest.mark.parametrize("name", PAGES)
def test_pages_made_from_the_code_are_up_to_date(name: str) -> None:
    """A reference that lags behind the code is worse than none."""
    make, command = PAGES[name]
    assert (DOCS / name).read_text(encoding="utf-8") == make(), f"run {command} > docs/{name}"


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """A page outside the navigation, or a link to nowhere, would not be noticed by its author."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, check=False, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "index.html").is_file()

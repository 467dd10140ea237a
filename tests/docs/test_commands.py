"""Every command line of the documentation, as a reader would type it.

Commands that simulate run both federates in this process for a second and a half at most, and draw
no figures; their report is written for the page about it alone. Everything else is as it is. Some
commands are only parsed, each for the reason that it stands with.
"""

import json
import re
import shlex
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from synthetic_result import outcome
from tieline.cli import app
from tieline.cli import run as run_command
from tieline.cosim.interfaces import Clock
from tieline.cosim.local import run_local
from tieline.experiment import drawn
from tieline.experiment.launch import Outcome
from tieline.experiment.sweep_run import InTurn
from tieline.experiment.watch import Progress
from tieline.grid.federate import open_participant as open_grid
from tieline.network.federate import open_participant as open_network

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES = [page for page in PAGES if page.name != "cli_reference.md"]

LONGEST_S = 1.5

ONLY_PARSED = {
    r"^doctor": "tests/doctor runs its federation",
    r"^(broker|join|gather)": "tests/experiment and the mark netns run the sides of a federation",
    r"^reproduce(?!.*--list)": "tests/paper runs items of it; all of them take minutes",
    r"--scheduler": "tests/sweeps runs two workers",
    r"^damping": "tests/test_cli_linear.py runs it on a real result",
    r"^(modes|freqresp) miniwecc": "tests/test_cli_linear.py and tests/linear run shorter ones",
    r"^(report|compare) results/": "stands for a folder of the reader's",
    r"^log": "tests/doctor prints the logs of a run whose processes were real",
    r"^topology import": "tests/network imports networks of all kinds",
    r"guest_controller": "tests/scenarios runs the guest",
}


def commands(text: str) -> Iterator[tuple[str, str]]:
    """Yield ('file', name) for each whole experiment of a page and ('run', words) for a command."""
    for block in re.split(r"(```yaml\n.*?```)", text, flags=re.DOTALL):
        if block.startswith("```yaml"):
            content = block.removeprefix("```yaml\n").removesuffix("```")
            if re.match(r"name: \w+\n", content) and "extends" not in content:
                yield "file", content
            continue
        for line in re.findall(r"^ {4}(?:\.venv/bin/)?tieline ([a-z].*)$", block, re.MULTILINE):
            yield "run", re.split(r"\s{3,}|\s>\s", line)[0]


def parse(words: list[str]) -> None:
    """Check that a command line names a command with its arguments and options."""
    group = typer.main.get_command(app)
    group.commands[words[0]].make_context(words[0], words[1:])  # type: ignore[attr-defined]


def launch(folder: Path, on_progress: Callable[[Progress], None]) -> Outcome:
    """Run the federation of a folder for a short time."""
    told = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    told["grid"]["duration"] = min(LONGEST_S, told["grid"]["duration"])
    told["clock"]["intervals"] = round(told["grid"]["duration"] * told["clock"]["rate_hz"])
    (folder / "run.json").write_text(json.dumps(told), encoding="utf-8")
    grid, network = open_grid(told, folder), open_network(told, folder)
    run_local(grid, network, Clock(**told["clock"]), lambda *_: None)
    return outcome(told["grid"]["duration"])


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(run_command, "launcher", lambda: launch)
    monkeypatch.setattr(run_command, "steps", lambda core: ((), ()))
    monkeypatch.setattr(run_command, "sweep_runner", lambda *_: InTurn(launch))
    monkeypatch.setattr(drawn, "draw", lambda *_: [])
    monkeypatch.setattr(drawn, "draw_network", lambda *_: [])
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")


@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_of_a_page_works(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader who types what the page says must not be the first to do so."""
    if page.stem != "report":
        monkeypatch.setattr(drawn, "write_page", lambda folder, _: folder / "report.html")
        monkeypatch.setattr(drawn, "write_point_pages", lambda _: None)
    for kind, text in commands(page.read_text(encoding="utf-8")):
        if kind == "file":
            name = text.split()[1]
            Path(f"{name}.yaml").write_text(text, encoding="utf-8")
            continue
        words = shlex.split(text)
        if any(re.search(pattern, text) for pattern in ONLY_PARSED):
            parse(words)
            continue
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, f"{text}\n{result.output}"

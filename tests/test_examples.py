"""The notebook in examples/, run from its first cell to its last."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).resolve().parents[1] / "examples" / "first_steps.ipynb"
MOST_BYTES = 150_000


@pytest.fixture(scope="module")
def stored() -> nbformat.NotebookNode:
    return nbformat.read(NOTEBOOK, as_version=4)


@pytest.mark.helics
@pytest.mark.slow
@pytest.mark.timeout(900)  # where nothing is compiled yet, it is the first to compile
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_the_notebook_runs_to_its_end_and_says_what_it_says_in_the_repository(
    stored: nbformat.NotebookNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A newcomer's first hour would end at a cell that fails, or shows other numbers."""
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    fresh = nbformat.from_dict(stored)
    options = {"timeout": 800, "kernel_name": "python3", "resources": {"metadata": {"path": "."}}}
    monkeypatch.chdir(tmp_path)
    NotebookClient(fresh, **options).execute()
    assert (tmp_path / "results" / "near" / "manifest.json").is_file()
    for before, after in zip(stored.cells, fresh.cells, strict=True):
        # The last figure that is shown may round either way on another processor.
        assert _numbers(after) == pytest.approx(_numbers(before), rel=1e-3, abs=2e-6), before["id"]


def test_the_notebook_is_stored_whole_with_small_outputs(stored: nbformat.NotebookNode) -> None:
    """One without outputs shows a reader nothing; large ones fill the history of the repository."""
    cells = [cell for cell in stored.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert NOTEBOOK.stat().st_size < MOST_BYTES


def _numbers(cell: nbformat.NotebookNode) -> list[float]:
    """Return the numbers with a fraction that a cell shows, apart from plots and progress."""
    shown = [output for output in cell.get("outputs", ()) if output.output_type != "stream"]
    texts = [output.data.get("text/plain", "") for output in shown]
    return [float(number) for text in texts for number in re.findall(r"-?\d+\.\d+", text)]

"""docs/experiments.md: what it shows can be run."""

import re
from pathlib import Path

import pytest

from tieline.experiment.load import load_experiment

PAGE = Path(__file__).resolve().parents[2] / "docs" / "experiments.md"
BLOCKS = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
HEAD = "name: shown\nextends: g26_trip_smoke\n"


def test_the_page_shows_experiments() -> None:
    """Otherwise the test below would look at nothing."""
    assert len(BLOCKS) == 4


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.split("\n")[1].strip())
def test_every_example_is_valid(tmp_path: Path, block: str) -> None:
    """Otherwise a reader would begin with a refusal."""
    text = block if block.startswith("extends") else HEAD + block
    (tmp_path / "shown.yaml").write_text(text, encoding="utf-8")
    assert load_experiment(str(tmp_path / "shown.yaml")).points

"""Every shipped experiment, broken in hundreds of ways: one clear message each, no traceback."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from experiment.mutations import Mutant, mutants
from tieline import yaml_lines
from tieline.errors import InputError
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.streams import stream

OF_EACH = 21
JARGON = re.compile(r"pydantic|Traceback|literal\[|constrained|Input should|discriminator|_type\b")
EXPERIMENTS = shipped_experiments()


def findings_of(path: Path, text: str) -> tuple[str, ...]:
    """Return what is found wrong with an experiment's text; nothing if it is sound."""
    path.write_text(text, encoding="utf-8")
    try:
        load_experiment(str(path))
    except InputError as error:
        return error.findings
    return ()


def lines_for(path: Path, mutant: Mutant) -> range:
    """Return the lines at which a mistake may be told: from the entry around it to its own."""
    document = yaml_lines.load(path)
    around = mutant.path[: max(2, len(mutant.path) - 2)]
    return range(document.line(around), document.line(mutant.path) + 1)


@pytest.mark.parametrize("source", EXPERIMENTS, ids=lambda path: path.stem)
def test_each_of_many_mistakes_gives_one_clear_message(tmp_path: Path, source: Path) -> None:
    """Otherwise some slip of a user would end in a traceback, or in a list of riddles.

    With all shipped experiments these are more than 200 mistakes.
    """
    assert OF_EACH * len(EXPERIMENTS) > 200
    path = tmp_path / "broken.yaml"
    made = mutants(yaml.safe_load(source.read_text()), stream(1, source.stem))
    for mutant, _ in zip(made, range(OF_EACH), strict=False):
        findings = findings_of(path, mutant.text)
        assert len(findings) == 1, (mutant, findings)
        place, _, sentence = findings[0].partition(": ")
        name, _, line = place.rpartition(":")
        assert name == str(path), (mutant, findings)
        assert int(line) in lines_for(path, mutant), (mutant, findings)
        assert 10 < len(sentence) < 600, findings
        assert not JARGON.search(sentence), findings


@pytest.mark.parametrize("seed", range(4))
def test_a_file_with_broken_text_is_sound_or_refused(tmp_path: Path, seed: int) -> None:
    """Otherwise a slip of the finger in the middle of a word could end in a traceback."""
    generator = stream(seed, "broken text")
    sources = [path for path in EXPERIMENTS if path.stem != "monte_carlo"]
    for _ in range(25):
        source = sources[int(generator.integers(len(sources)))]
        text = scribbled(source.read_text(encoding="utf-8"), generator)
        for finding in findings_of(tmp_path / "broken.yaml", text):
            assert "broken.yaml" in finding
            assert not JARGON.search(finding), finding


def scribbled(text: str, generator: np.random.Generator) -> str:
    """Return a text with some characters lost, doubled or replaced."""
    letters = list(text)
    for _ in range(int(generator.integers(1, 4))):
        at = int(generator.integers(len(letters)))
        strange = "{}[]:,&*#?|-<>=!%@`'\"\t\n 0é"
        letters[at] = ("", letters[at] * 2, strange[int(generator.integers(len(strange)))])[
            int(generator.integers(3))
        ]
    return "".join(letters)

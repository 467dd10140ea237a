"""Experiment files: whatever the text, `load_experiment` returns a study or says what is wrong."""

import copy
import functools
from pathlib import Path
from typing import Any

import yaml

from fuzz.script import Script, as_yaml, edited, edited_text, edited_tree, scratch
from tieline.errors import InputError
from tieline.experiment.load import load_experiment
from tieline.resources import shipped

SLOW = ("monte_carlo",)
"""Sweeps whose hundreds of points would be checked for each input."""


def one_input(data: bytes) -> None:
    """Load what an input makes of a shipped experiment."""
    script = Script(data)
    path = scratch() / "experiment.yaml"
    path.write_bytes(content(script))
    try:
        study = load_experiment(str(path))
    except InputError as error:
        assert error.findings, "an error without a finding"
        assert all("Traceback" not in text and len(text) < 3_000 for text in error.findings)
        return
    # What a run would write down of it must be printable.
    study.base.model_dump_json()


def content(script: Script) -> bytes:
    """Return the file that a script makes."""
    manner = script.below(8)
    if manner == 0:
        return script.rest()
    path, tree = script.one(_shipped())
    if manner == 1:
        return edited(path.read_bytes(), script)
    if manner < 4:
        return edited_text(path.read_text(encoding="utf-8"), script)
    return as_yaml(edited_tree(copy.deepcopy(tree), script))


@functools.cache
def _shipped() -> list[tuple[Path, Any]]:
    paths = [path for path in sorted(shipped("configs").glob("*.yaml")) if path.stem not in SLOW]
    return [(path, yaml.safe_load(path.read_text(encoding="utf-8"))) for path in paths]

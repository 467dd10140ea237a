"""The JSON Schema of an experiment, and the page that is written from it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from tieline.experiment.json_schema import FILE_NAME, as_text, editor_line, json_schema, target
from tieline.experiment.layers import shipped_experiments
from tieline.experiment.reference import reference_page
from tieline.experiment.schema import Experiment
from tieline.problems import checked
from tieline.resources import shipped

CHECKOUT = Path(__file__).resolve().parents[2]
SCHEMA = json_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)
EXPERIMENTS = [*shipped_experiments(), CHECKOUT / "examples" / "my_pss" / "experiment.yaml"]
SMALL = {"name": "a", "question": "b"}


def fields() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (place, schema) of every setting; points of sweeps refer to those."""
    groups = {"": SCHEMA, **SCHEMA["$defs"]}
    for name, group in groups.items():
        for key, own in group.get("properties", {}).items():
            if "$ref" not in own or "description" in own:
                yield f"{name}.{key}", own


def numbers(own: Any) -> Iterator[dict[str, Any]]:
    """Yield every number that may stand in a setting, in lists and alternatives, too."""
    if isinstance(own, dict):
        kinds = own.get("type")
        if {"number", "integer"} & set(kinds if isinstance(kinds, list) else [kinds]):
            yield own
        for key, inner in own.items():
            if key not in ("properties", "patternProperties"):
                yield from numbers(inner)
    elif isinstance(own, list):
        for inner in own:
            yield from numbers(inner)


def test_it_is_a_schema_of_the_draft_that_it_names() -> None:
    """Otherwise no editor could read it."""
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == jsonschema.Draft202012Validator.META_SCHEMA["$id"]


@pytest.mark.parametrize("path", EXPERIMENTS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_shipped_experiment_follows_it_and_names_it(path: Path) -> None:
    """Otherwise an editor would mark what is right, or complete nothing."""
    text = path.read_text(encoding="utf-8")
    assert [error.message for error in VALIDATOR.iter_errors(yaml.safe_load(text))] == []
    (line,) = [line for line in text.splitlines() if "yaml-language-server" in line]
    named = path.parent / line.partition("$schema=")[2]
    assert named.resolve() == (shipped("configs") / FILE_NAME).resolve()
    assert line == editor_line(line.partition("$schema=")[2])


def test_the_shipped_schema_and_the_reference_page_are_those_of_the_code() -> None:
    """Otherwise editors and readers would be told what held once.

    `tieline schema > configs/experiment.schema.json` and
    `tieline schema --markdown > docs/experiment_reference.md` write them anew.
    """
    assert (shipped("configs") / FILE_NAME).read_text(encoding="utf-8") == as_text(SCHEMA)
    page = CHECKOUT / "docs" / "experiment_reference.md"
    assert page.read_text(encoding="utf-8") == reference_page()


def test_every_setting_has_a_sentence_and_every_optional_one_a_default() -> None:
    """Otherwise hovering over a key would tell nothing."""
    wordless = [place for place, own in fields() if len(own.get("description", "")) < 8]
    assert wordless == []
    required = {
        f"{name}.{key}"
        for name, group in {"": SCHEMA, **SCHEMA["$defs"]}.items()
        for key in group.get("required", ())
    }
    unclear = [
        place
        for place, own in fields()
        if place not in required
        and "default" not in own
        and "properties" not in target(own, SCHEMA["$defs"])
        and "$ref" not in own
    ]
    assert unclear == [".question", ".extends"]


def test_every_number_has_its_unit_and_both_bounds() -> None:
    """Otherwise a user would have to guess what 5 means, or find a limit by running into it.

    What the device models and the swept settings declare themselves has no bounds here, nor has a
    DSCP in a list, which is checked with its neighbours.
    """
    elsewhere = {"the model's", "the setting's"}
    found = [(place, number) for place, own in fields() for number in numbers(own)]
    found = [pair for pair in found if pair[0] != "SweepPoint.label"]
    assert len(found) > 100
    assert [place for place, number in found if not number.get("unit")] == []
    unbounded = {
        place
        for place, number in found
        if number["unit"] not in elsewhere
        and not (
            {"minimum", "exclusiveMinimum"} & set(number)
            and {"maximum", "exclusiveMaximum"} & set(number)
        )
    }
    assert unbounded == {"ClassEntry.dscp", "ShareEntry.dscp", "Integers.integers"}


@pytest.mark.parametrize(
    ("group", "key", "value", "is_right"),
    [
        ("grid", "duration", "250 ms", True),
        ("grid", "duration", 20, True),
        ("grid", "duration", "250 km", False),
        ("grid", "duration", -1, False),
        ("grid", "duration", "-1 s", False),
        ("grid", "duration", 0, False),
        ("grid", "steps_per_second", "0.24 kHz", True),
        ("grid", "steps_per_second", 240.5, False),
        ("network", "loss", "2 %", True),
        ("network", "loss", 1, False),
        ("network", "mean_delay", None, True),
        ("network", "mean_delay", [], False),
        ("wams", "reporting", "continuous", True),
        ("wams", "reporting", "60 Hz", True),
        ("wams", "reporting", "often", False),
        ("network", "jitter", {"distribution": "uniform", "low": 0, "high": "5 ms"}, True),
        ("network", "jitter", {"distribution": "uniform", "low": 0}, False),
        ("network", "queue", {"discipline": "drop_tail", "bytes": "20 kB"}, True),
        ("network", "queue", {"discipline": "lifo", "packets": 20}, False),
        ("network", "xyzzy", 1, False),
        (
            "grid",
            "events",
            [{"at": "1 s", "brake_bus": 18, "size_MW": "1.4 GW", "duration": 1}],
            True,
        ),
        ("grid", "events", [{"at": "1 s", "brake_bus": 18}], False),
    ],
)
def test_it_judges_as_the_loader_does(group: str, key: str, value: Any, is_right: bool) -> None:
    """Otherwise an editor would accept what `tieline validate` refuses."""
    data = {**SMALL, group: {key: value}}
    assert VALIDATOR.is_valid(data) == is_right
    assert (not checked(Experiment, data)[1]) == is_right


@pytest.mark.parametrize(
    ("sweep", "is_right"),
    [
        ([], True),
        ([{"label": "a", "network.mean_delay": "1 s", "grid.events.0.at": "2 s"}], True),
        ([{"network.mean_delay": "1 s"}], False),
        ([{"label": "a", "network.mean_dely": "1 s"}], False),
        ([{"label": "a", "network.mean_delay": "1 km"}], False),
        ({"method": "grid", "over": {"grid.pss.beta1": [0, 1]}}, True),
        ({"method": "random", "points": 5, "over": {"seed": {"integers": [1, 9]}}}, True),
        ({"method": "grid", "over": {"grid.pss.beta9": [0, 1]}}, False),
        (
            {"method": "grid", "over": {"grid.pss.tuning.G1.K": {"linspace": [1, 2], "count": 3}}},
            True,
        ),
        ({"method": "grid", "over": {"grid.pss.beta1": {"unifrom": [0, 1]}}}, False),
        ("twice", False),
    ],
)
def test_it_knows_both_forms_of_a_sweep(sweep: Any, is_right: bool) -> None:
    """Otherwise dotted keys, the longest to type, would not be completed."""
    assert VALIDATOR.is_valid({**SMALL, "sweep": sweep}) == is_right


def test_a_question_may_come_from_what_is_extended() -> None:
    """Otherwise editors would ask for what the loader does not."""
    assert VALIDATOR.is_valid({"name": "a", "extends": "g26_trip"})
    assert not VALIDATOR.is_valid({"name": "a"})


def test_the_page_has_a_section_for_every_group_and_kind() -> None:
    """Otherwise a kind of traffic or loss would be found in the code alone."""
    titles = [line[3:] for line in reference_page().splitlines() if line.startswith("## ")]
    assert len(titles) == len(set(titles)) + 1  # classes of the two queues that have them
    for title in (
        "grid.pss",
        "grid.events: fault_bus",
        "network.jitter: gamma",
        "sweep.over: normal",
    ):
        assert title in titles

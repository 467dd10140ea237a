"""YAML with line numbers: every value is found again, everything odd is refused with its line."""

from pathlib import Path

import pytest
import yaml

from tieline import yaml_lines
from tieline.errors import InputError
from tieline.resources import shipped
from tieline.yaml_lines import Document, load

TEXT = """\
# comment
name: x
links:
  - {a: A, b: B,
     rate: 10 Mbit/s}
  - a: C
    rate: 2
60: sixty
"""


def loaded(folder: Path, text: str) -> Document:
    """Return the document of a file with this text."""
    path = folder / "file.yaml"
    path.write_text(text, encoding="utf-8")
    return load(path)


def test_values_come_with_the_line_of_their_key_or_item(tmp_path):
    """Otherwise an error message would send its reader to the wrong line."""
    document = loaded(tmp_path, TEXT)
    assert document.data["links"][0]["rate"] == "10 Mbit/s"
    lines = {
        (): 2,
        ("name",): 2,
        ("links",): 3,
        ("links", 0): 4,
        ("links", 0, "rate"): 5,
        ("links", 1): 6,
        ("links", 1, "rate"): 7,
        (60,): 8,
    }
    assert {position: document.line(position) for position in lines} == lines


def test_a_position_that_is_not_there_gets_the_line_around_it(tmp_path):
    """Otherwise a missing key could not be reported at all."""
    document = loaded(tmp_path, TEXT)
    assert document.line(("links", 1, "queue")) == 6
    assert document.where(("links", 9, "a", "b")) == f"{document.path}:3"


def test_an_empty_file_holds_nothing(tmp_path):
    """Otherwise an empty file would crash instead of being refused for what it lacks."""
    assert loaded(tmp_path, "").data is None


def test_aliases_are_written_out_where_they_stand(tmp_path):
    """Otherwise a file could not say a jitter once and use it twice."""
    document = loaded(tmp_path, "a: &j {low: 1}\nb: *j\n")
    assert document.data == {"a": {"low": 1}, "b": {"low": 1}}


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("a: 1\nb: 2\na: 3\n", 3, "key 'a' stands twice (first on line 1)"),
        ("a: 1\nb: [2\nc: 3\n", 3, "flow sequence"),
        ("a: 1\n\tb: 2\n", 2, "token"),
        ("a: &x [1, *x]\n", 1, "alias"),
        ("a: !new 3\n", 1, "!new"),
        ("a: 1\nb: !!python/object:os.system {}\n", 2, "python"),
        ("<<: {a: 1}\n", 1, "merge keys"),
        ("? [1, 2]\n: 3\n", 1, "single word"),
        ("a: 1\n---\nb: 2\n", 2, "single document"),
        ("a: 2001-99-99\n", 1, "2001-99-99"),
        ("a: 1\nb: \x07\n", 2, "unacceptable character"),
    ],
)
def test_odd_files_are_refused_with_file_and_line(tmp_path, text, line, reason):
    """Otherwise a slip would run as something that nobody wrote."""
    with pytest.raises(InputError) as caught:
        loaded(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'file.yaml'}:{line}: ")
    assert reason in str(caught.value)


def test_nested_aliases_cannot_exhaust_the_memory(tmp_path):
    """Otherwise a file of ten lines could take down the machine that checks it."""
    bomb = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    bomb += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    with pytest.raises(InputError, match="more than 200000 values"):
        loaded(tmp_path, "\n".join(bomb))


def test_deep_nesting_is_refused(tmp_path):
    """Otherwise a file of brackets would end in a traceback."""
    with pytest.raises(InputError, match="nested more than 100 groups deep"):
        loaded(tmp_path, "[" * 2_000)


def test_files_that_cannot_be_read_are_refused(tmp_path):
    """Otherwise a misspelt path would end in a traceback."""
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / "missing.yaml")
    path = tmp_path / "latin.yaml"
    path.write_bytes(b"a: \xe9\n")
    with pytest.raises(InputError, match="not UTF-8"):
        load(path)


def test_both_parsers_read_every_shipped_file_alike():
    """Otherwise a result would depend on whether PyYAML was built with its parser in C."""
    files = [*shipped("cases").rglob("*.yaml"), *shipped("configs").rglob("*.yaml")]
    for path in files:
        text = path.read_text(encoding="utf-8")
        fast, slow = (
            yaml_lines._read_with(kind, path, text) for kind in (yaml_lines._FAST, yaml.SafeLoader)
        )
        assert fast.data == slow.data
        assert fast._lines == slow._lines
    assert len(files) > 10

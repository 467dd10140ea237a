"""Case folders: whatever stands in tables and case.yaml, they are a case or have findings.

Tables that are a case are also solved for their power flow and brought to rest.
"""

import functools
import shutil
from pathlib import Path

import yaml

from fuzz.script import NASTY_TEXTS, Script, as_yaml, edited, edited_text, edited_tree, scratch
from tieline.errors import InputError, NumericalError
from tieline.grid.case import load_case
from tieline.grid.check import check
from tieline.grid.settings import GridSettings
from tieline.resources import case_folder
from tieline.wams.settings import WamsSettings

CASE = "two_area"


def one_input(data: bytes) -> None:
    """Load and check what an input makes of a shipped case."""
    script = Script(data)
    whole, folder = _whole(), scratch() / CASE
    name = script.one(sorted(whole))
    spoilt = content(script, name, whole[name])
    try:
        (folder / name).write_bytes(spoilt)
        case = load_case(folder)
        check(case, GridSettings(), WamsSettings())
    except (InputError, NumericalError) as error:
        assert "Traceback" not in str(error)
        assert len(str(error)) < 200_000
    finally:
        (folder / name).write_bytes(whole[name])


def content(script: Script, name: str, whole: bytes) -> bytes:
    """Return the file that a script makes of a whole one."""
    manner = script.below(8)
    if manner == 0:
        return script.rest()
    if manner == 1:
        return edited(whole, script)
    if manner == 2:
        return edited_text(whole.decode(), script)
    if name.endswith(".yaml"):
        return as_yaml(edited_tree(yaml.safe_load(whole), script))
    return _edited_cells(whole.decode(), script)


def _edited_cells(text: str, script: Script) -> bytes:
    """Return a table with some cells replaced, or rows doubled, dropped or swapped."""
    rows = [line.split(",") for line in text.splitlines()]
    for _ in script.rounds():
        deed, at = script.below(8), script.below(len(rows))
        if deed == 0 and len(rows) > 1:
            del rows[at]
        elif deed == 1:
            rows.insert(at, list(script.one(rows)))
        elif deed == 2:
            other = script.one(rows)
            cell = script.below(len(rows[at]))
            rows[at][cell] = other[cell % len(other)]
        elif deed < 6:
            rows[at][script.below(len(rows[at]))] = _number(script)
        else:
            rows[at][script.below(len(rows[at]))] = script.one(NASTY_TEXTS)
    return "\n".join(",".join(row) for row in rows).encode("utf-8", "surrogatepass")


def _number(script: Script) -> str:
    mantissa, exponent = script.below(1 << 16) - (1 << 15), script.below(24) - 14
    return f"{mantissa}e{exponent}"


@functools.cache
def _whole() -> dict[str, bytes]:
    """Return the files of the case, copied to where they are spoilt."""
    source, target = case_folder(CASE), scratch() / CASE
    target.mkdir(exist_ok=True)
    paths = [path for path in source.iterdir() if path.suffix in (".csv", ".yaml")]
    for path in paths:
        shutil.copy(path, target / path.name)
    return {path.name: Path(path).read_bytes() for path in paths}

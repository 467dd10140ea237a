"""Stabilisers from outside the package: installed ones, and a file."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.grid.models import registry
from tieline.grid.models.base import Model
from tieline.grid.models.registry import models, use_file
from tieline.grid.pss_settings import PssSettings

MODEL = '''
from tieline.grid.models.base import Equation, Model, Parameter


def equations(x, u, p, dx, y):
    """Write v_s."""
    y[0] = p[0] * (u[0] - u[1])


class {name}(Model):
    """v_s = K (omega - w0). Not modelled: all else."""

    key = "{key}"
    role = "{role}"
    source = "a test"
    parameters = (Parameter("K", "pu", "gain"),)
    states = ("none",)
    equations = (Equation(equations, ("{signal}", "w0"), ("v_s",)),)
'''
SOUND = {"name": "Mine", "key": "mine", "role": "pss", "signal": "omega"}


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Path]:
    """A file with one sound model, taken out of use afterwards."""
    path = tmp_path / "own.py"
    path.write_text(MODEL.format(**SOUND))
    yield path
    use_file("pss", None)


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the path that holds an installed package with an entry point."""
    metadata = tmp_path / "other_pss-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: other-pss\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[tieline.pss]\nmine = other_pss:Mine\n")
    (tmp_path / "other_pss.py").write_text(MODEL.format(**SOUND))
    monkeypatch.syspath_prepend(tmp_path)
    registry._installed.cache_clear()
    yield tmp_path
    registry._installed.cache_clear()
    sys.modules.pop("other_pss", None)


def test_a_file_brings_its_models_until_another_takes_its_place(own: Path, tmp_path: Path) -> None:
    """What an experiment does not name must not be there for it."""
    use_file("pss", own)
    assert models("pss")["mine"].parameters[0].symbol == "K"
    other = tmp_path / "other.py"
    other.write_text(MODEL.format(**SOUND | {"key": "others"}))
    use_file("pss", other)
    assert "others" in models("pss")
    assert "mine" not in models("pss")
    use_file("pss", None)
    assert "others" not in models("pss")


def test_a_file_keeps_its_classes_when_it_is_used_again(own: Path) -> None:
    """Two classes of one file would be two groups of units, compiled twice."""
    use_file("pss", own)
    first = models("pss")["mine"]
    use_file("pss", None)
    use_file("pss", own)
    assert models("pss")["mine"] is first


def test_a_module_is_named_after_its_place_so_that_the_compilers_cache_holds(own: Path) -> None:
    """A name that changed from run to run would mean compiling again in each."""
    use_file("pss", own)
    name = models("pss")["mine"].__module__
    assert name.startswith("tieline_file_")
    assert name.endswith("_own")
    assert sys.modules[name].__file__ == str(own)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1\n", "own.py defines no subclass of tieline.grid.models.base.Model"),
        ("x = 1\ny = = 2\n", "own.py:2: SyntaxError"),
        ("x = 1\n\ny = unknown\n", "own.py:3: NameError: name 'unknown' is not defined"),
        (MODEL.format(**SOUND | {"role": "exciter"}), "Mine: role must be 'pss' (got 'exciter')"),
        (MODEL.format(**SOUND | {"key": "Mine"}), "key must be lower case, digits and _"),
        (MODEL.format(**SOUND | {"key": "pss1a"}), "key 'pss1a' is that of a shipped model"),
        (MODEL.format(**SOUND | {"signal": "omga"}), "no known signal 'omga'"),
        (MODEL.format(**SOUND).replace('source = "a test"', ""), "Mine does not declare source"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_the_reason(
    own: Path, text: str, words: str
) -> None:
    """An author sees the fault in words of the file, not in a traceback of ours."""
    own.write_text(text)
    with pytest.raises(InputError) as caught:
        use_file("pss", own)
    assert words in str(caught.value)
    assert str(caught.value).startswith("grid.pss.file: ")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    """A federate started by hand may be given a path that is not there."""
    with pytest.raises(InputError, match=r"grid\.pss\.file: no file .*none\.py"):
        use_file("pss", tmp_path / "none.py")


def test_an_installed_package_brings_its_model(installed: Path) -> None:
    """A laboratory's stabilisers need no path in every experiment."""
    assert issubclass(models("pss")["mine"], Model)
    assert PssSettings(model="mine").model == "mine"


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("mine = other_pss:Nobody", "cannot be loaded: AttributeError"),
        ("mine = nowhere:Mine", "cannot be loaded: ModuleNotFoundError"),
        ("mine = other_pss:equations", "is no subclass of"),
        ("yours = other_pss:Mine", "must be named as its model, 'mine'"),
    ],
)
def test_a_broken_entry_point_is_named(installed: Path, entry: str, words: str) -> None:
    """The user must learn which of the installed packages to repair."""
    (installed / "other_pss-1.0.dist-info" / "entry_points.txt").write_text(
        f"[tieline.pss]\n{entry}\n"
    )
    with pytest.raises(InputError) as caught:
        models("pss")
    assert words in str(caught.value)
    assert f"entry point {entry} of group tieline.pss" in str(caught.value)

"""What no file of the package does, whatever a config, case, frame or result says."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import tieline
from tieline.errors import InputError
from tieline.experiment.load import load_experiment
from tieline.network.captures import capture_names
from tieline.network.queues import DropTail
from tieline.network.spec import Link
from tieline.yaml_lines import MAX_VALUES, load

ROOT = Path(tieline.__file__).parent
MODULES = sorted(ROOT.rglob("*.py"))
ROWS = ("pickle", "cPickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "jsonpickle")
BUILTINS = ("eval", "exec", "compile", "__import__")
METHODS = {
    "os": ("system", "popen", "execl", "execlp", "spawnl"),
    "yaml": ("load", "load_all", "unsafe_load", "full_load", "unsafe_load_all", "full_load_all"),
    "importlib": ("import_module",),
}
LOADS_CODE = {
    Path("grid/plugins.py"): ("spec.loader.exec_module", "a Python file that the user names"),
    Path("kernels.py"): ("pickle", "compiled code, from the user's own cache"),
}
"""What may turn data into code, how, and from where."""
OWN_MODULES = {"__init__.py", "grid/models/registry.py", "wams/__init__.py"}
OWN_MODULES |= {"sweeps/fork.py", "sweeps/single.py"}
"""They import modules of this package: by names in the code, or that lie in one of its folders."""


def dangers(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            yield from (name for name in names if name.partition(".")[0] in ROWS)
        if not isinstance(node, ast.Call):
            continue
        if isinstance(node.func, ast.Name) and node.func.id in BUILTINS:
            yield node.func.id
        if isinstance(node.func, ast.Attribute):
            of = node.func.value.id if isinstance(node.func.value, ast.Name) else ""
            if node.func.attr in METHODS.get(of, ()) or node.func.attr == "exec_module":
                yield f"{of}.{node.func.attr}"
        for keyword in node.keywords:
            if keyword.arg in ("shell", "allow_pickle") and (
                not isinstance(keyword.value, ast.Constant) or keyword.value.value
            ):
                yield f"{keyword.arg}="


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_nothing_turns_data_into_code(path: Path) -> None:
    """If something did, a result or a case from a colleague could run anything on this computer."""
    found = set(dangers(path))
    own = path.relative_to(ROOT)
    if own in LOADS_CODE:
        found.discard(LOADS_CODE[own][0])
        found.discard(".exec_module")
    if own.as_posix() in OWN_MODULES:
        found.discard("importlib.import_module")
    assert not found


def test_a_document_of_nested_aliases_is_refused(tmp_path: Path) -> None:
    """If not, a kilobyte of YAML would fill the memory."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    path = tmp_path / "bomb.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=f"{MAX_VALUES}"):
        load(path)
    path.write_text("[" * 100_000, encoding="utf-8")
    with pytest.raises(InputError, match="nested"):
        load(path)
    path.write_text("a: !!python/object/apply:os.system ['true']\n", encoding="utf-8")
    with pytest.raises(InputError, match="tag"):
        load(path)


BAD_NAMES = ["../x", "/etc/x", "..", ".", "a/b", "a\\0b", "a b", "", "-x", "x" * 81, "a\\nb"]


@pytest.mark.parametrize("name", BAD_NAMES)
def test_the_name_of_a_run_is_no_path(name: str, tmp_path: Path) -> None:
    """If not, an experiment could have its results written over somebody's files."""
    path = tmp_path / "e.yaml"
    path.write_text(f'name: "{name}"\nquestion: q?\ncase: miniwecc\n', encoding="utf-8")
    with pytest.raises(InputError):
        load_experiment(str(path))


@pytest.mark.parametrize("label", ["../../x", "/etc/passwd", "a\\0b", "..", "CON", "a/../../b"])
def test_the_folder_of_a_point_lies_in_its_sweep(label: str, tmp_path: Path) -> None:
    """If not, a sweep could write outside its result."""
    path = tmp_path / "e.yaml"
    words = f'name: e\nquestion: q?\ncase: miniwecc\nsweep: [{{label: "{label}", seed: 2}}]\n'
    path.write_text(words, encoding="utf-8")
    try:
        (point,) = load_experiment(str(path)).points
    except InputError:
        return
    folder = tmp_path / "points" / point.slug
    assert folder.resolve().parent == (tmp_path / "points").resolve()
    assert folder.name == point.slug != ""


@pytest.mark.parametrize("name", ["../x", "x.y/..", "{config}", "a-b", "1a", "a\\0", "x" * 41])
def test_the_name_of_a_guest_is_no_path(name: str, tmp_path: Path) -> None:
    """If not, a guest's HELICS file could be written anywhere."""
    path = tmp_path / "e.yaml"
    guest = f'{{name: "{name}", command: python guest.py}}'
    words = f"name: e\nquestion: q?\ncase: miniwecc\nfederation: {{guests: [{guest}]}}\n"
    path.write_text(words, encoding="utf-8")
    with pytest.raises(InputError, match="guests"):
        load_experiment(str(path))


def test_captures_stay_in_their_folder_whatever_the_nodes_are_called(tmp_path: Path) -> None:
    """If not, a topology with a node named ../../x would write beside the result."""
    pairs = [("a", "b"), ("../../x", "b"), ("/etc", "."), ("a/b", "c"), ("a_b", "c"), ("a\0", "b")]
    links = [Link(a, b, 1, 1, DropTail(1)) for a, b in pairs]
    names = capture_names(links, range(len(links)))
    assert names[0] == "a-b.pcap"
    assert len(set(names.values())) == len(links)
    for name in names.values():
        assert (tmp_path / name).resolve().parent == tmp_path.resolve()
        assert not name.startswith(".")

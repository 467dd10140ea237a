"""Who may import whom."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import tieline

ROOT = Path(tieline.__file__).parent
MODULES = sorted(ROOT.rglob("*.py"))


@cache
def imports(path: Path) -> set[str]:
    """Return the full names of what a module imports, wherever in it."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def begins(names: set[str], *prefixes: str) -> set[str]:
    return {n for n in names if any(n == p or n.startswith(f"{p}.") for p in prefixes)}


def part(name: str) -> list[Path]:
    return [path for path in MODULES if path.relative_to(ROOT).parts[0] == name]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_only_cosim_imports_helics(path: Path) -> None:
    """HELICS in a second place would mean a second set of its traps."""
    if path not in part("cosim"):
        assert not begins(imports(path), "helics")


@pytest.mark.parametrize(("one", "other"), [("grid", "network"), ("network", "grid")])
def test_grid_and_network_never_import_each_other(one: str, other: str) -> None:
    """They meet in the federation only; a short cut would carry a packet past the network."""
    for path in part(one):
        assert not begins(imports(path), f"tieline.{other}"), path


def test_the_network_specification_knows_no_engine() -> None:
    """One specification must serve every engine."""
    engines = ("ideal", "packet", "engine", "ns3")
    names = imports(ROOT / "network" / "spec.py")
    assert not begins(names, *(f"tieline.network.{engine}" for engine in engines))


def test_the_launcher_starts_federates_and_does_not_import_them() -> None:
    """A federate inside the launcher could not be killed when it hangs."""
    for path in part("experiment"):
        forbidden = ("tieline.grid.federate", "tieline.network.federate", "tieline.cosim.together")
        assert not begins(imports(path), *forbidden), path


def test_what_compares_reads_result_folders_only() -> None:
    """A comparison that reached into a simulation could show what no folder holds."""
    for path in part("compare"):
        packages = ("grid", "network", "cosim", "wams", "sweeps")
        assert not begins(imports(path), *(f"tieline.{name}" for name in packages)), path


def test_only_the_cluster_needs_dask() -> None:
    """Dask is an extra: without it, all else must work."""
    for path in MODULES:
        if path != ROOT / "sweeps" / "cluster.py":
            assert not begins(imports(path), "distributed", "dask", "tieline.sweeps.cluster") or (
                path == ROOT / "sweeps" / "start.py"
            ), path


@pytest.mark.parametrize("name", ["artist", "drawn", "plots", "report", "summary", "table"])
def test_what_reports_reads_result_folders_only(name: str) -> None:
    """A report that reached into a simulation could show what no folder holds."""
    names = imports(ROOT / "experiment" / f"{name}.py")
    assert not begins(names, "tieline.grid", "tieline.network", "tieline.cosim", "tieline.wams")


def test_importing_tieline_imports_nothing_large() -> None:
    """Otherwise every command and every federate would wait for what it never uses."""
    script = (
        "import sys; before = set(sys.modules); import tieline; tieline.TielineError;"
        "print(*sorted({name.partition('.')[0] for name in set(sys.modules) - before}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    )
    assert set(done.stdout.split()) <= {"tieline", *sys.stdlib_module_names}


def test_no_part_of_the_package_takes_the_notebooks_names() -> None:
    """The notebook's side stands on the rest; the other way round, two would need each other."""
    for path in MODULES:
        if path not in [*part("api"), ROOT / "__init__.py"]:
            assert not begins(imports(path), "tieline.api"), path


def test_a_notebook_starts_federates_and_does_not_import_them() -> None:
    """A federate inside a notebook's process could not be killed when it hangs."""
    for path in part("api"):
        forbidden = ("tieline.grid.federate", "tieline.network.federate", "tieline.cosim")
        assert not begins(imports(path), *forbidden), path


@pytest.mark.parametrize("path", part("report"), ids=lambda path: path.name)
def test_a_page_is_written_from_result_folders_only(path: Path) -> None:
    """A page must come out the same from a folder that was made elsewhere, by whatever made it."""
    allowed = ("results", "table")
    names = imports(path)
    assert not begins(names, "tieline.grid", "tieline.network", "tieline.cosim", "tieline.wams")
    known = begins(names, *(f"tieline.experiment.{name}" for name in allowed))
    assert begins(names, "tieline.experiment") <= known


def test_what_draws_figures_knows_nothing_of_what_they_show() -> None:
    """Panels and files must serve a case's modes as well as a run."""
    for path in part("figures"):
        names = imports(path)
        assert begins(names, "tieline") <= begins(names, "tieline.figures"), path


def test_nothing_rests_on_the_reproduction_of_the_paper() -> None:
    """It uses everything; whatever used it would be tied to one paper."""
    for path in MODULES:
        if path.relative_to(ROOT).parts[0] not in ("paper", "cli"):
            assert not begins(imports(path), "tieline.paper"), path


def test_only_the_worker_of_the_reproduction_holds_federates() -> None:
    """Its runs go through plan and result folder like any other; one module knows the short cut."""
    for path in part("paper"):
        if path.name != "worker.py":
            names = imports(path)
            assert not begins(names, "tieline.grid.federate", "tieline.network.federate"), path
            assert not begins(names, "tieline.cosim.local", "tieline.paper.worker"), path


def test_what_keeps_logs_knows_nothing_of_a_run() -> None:
    """A federate that logs would otherwise bring the launcher with it, and the tables' readers."""
    allowed = ("errors", "logs", "units")
    for path in part("logs"):
        known = begins(imports(path), *(f"tieline.{name}" for name in allowed))
        assert begins(imports(path), "tieline") <= known, path
        assert not begins(imports(path), "numpy", "pandas", "pyarrow"), path


def test_floats_and_nanoseconds_meet_in_units_alone() -> None:
    """A second conversion is a second rounding."""
    conversion = re.compile(r"[*/]\s*1e-?9\b")
    for path in [*part("grid"), *part("network"), *part("wams"), *part("cosim")]:
        assert not conversion.search(path.read_text(encoding="utf-8")), path


def test_a_packet_is_looked_up_without_grid_and_federation() -> None:
    """What is repeated is the network of a result; a whole run would be another run."""
    for path in part("fates"):
        forbidden = ("tieline.grid", "tieline.network.federate", "tieline.cosim.federate")
        assert not begins(imports(path), *forbidden), path


READY = (
    "import tieline.experiment.run, tieline.experiment.report;"
    "from tieline.sweeps.single import shared_steps, own_steps;"
    "[step() for step in (*shared_steps(), *own_steps('zmq'))]"
)
LARGE = {"numba", "llvmlite", "matplotlib", "pandas", "pyarrow", "scipy", "networkx", "helics"}


@pytest.mark.parametrize(
    ("script", "forbidden"),
    [
        ("import tieline.cli", LARGE | {"numpy", "pydantic", "yaml", "rich"}),
        ("from tieline.experiment.load import load_experiment as l; l('g26_trip')", LARGE),
        (READY, {"pandas", "matplotlib", "networkx"}),
    ],
    ids=["the command line", "a checked experiment", "a launcher with its federates"],
)
def test_nothing_large_is_imported_before_it_is_used(script: str, forbidden: set[str]) -> None:
    """Help and a mistake in a file would come seconds late, and every federate start so."""
    told = "import sys; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", f"{script}; {told}"], check=True, capture_output=True, text=True
    )
    assert not forbidden & set(done.stdout.split())

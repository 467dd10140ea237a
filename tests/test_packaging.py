"""The wheel, and a bare checkout."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tieline import report

ASSETS = Path(report.__file__).with_name("assets")
CHECKOUT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    subprocess.run([*command, str(CHECKOUT)], check=True, capture_output=True)
    return zipfile.ZipFile(next(folder.glob("*.whl")))


def test_the_wheel_brings_one_package_with_its_cases_and_experiments(
    wheel: zipfile.ZipFile, tmp_path: Path
) -> None:
    """A wheel without its cases could run nothing; one with `cases/` on top would litter."""
    names = wheel.namelist()
    assert {name.split("/")[0] for name in names} == {"tieline", "tieline-0.1.0.dist-info"}
    assert "tieline/paper/page.html" in names
    wheel.extractall(tmp_path)
    script = (
        "import tieline; from tieline.resources import case_folder, shipped\n"
        "from tieline.grid.case import load_case\n"
        "print(tieline.__file__, load_case(case_folder('miniwecc')).name, shipped('configs'))"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    module, case, configs = done.stdout.split()
    assert Path(module).is_relative_to(tmp_path)
    assert case == "miniwecc"
    assert Path(configs) == tmp_path / "tieline" / "_data" / "configs"


def test_the_wheel_brings_what_its_pages_are_made_of(wheel: zipfile.ZipFile) -> None:
    """A page of an installed tieline would be words alone, or lack the library's licence."""
    names = wheel.namelist()
    inside = [name.removeprefix("tieline/report/") for name in names]
    wanted = {f"assets/{path.name}" for path in ASSETS.iterdir()}
    assert {"assets/main.js", "assets/style.css"} <= wanted <= set(inside)
    assert {"vendor/uplot/uPlot.iife.min.js", "vendor/uplot/LICENSE"} <= set(inside)
    assert any(
        name.endswith("licenses/federates/tieline/report/vendor/uplot/LICENSE") for name in names
    )


def test_the_runner_of_a_checkout_runs_the_checkouts_own_code(tmp_path: Path) -> None:
    """An installed tieline must not answer for the code that somebody is changing."""
    done = subprocess.run(
        [sys.executable, str(CHECKOUT / "runner.py"), "list"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
    )
    assert "g26_trip" in done.stdout
    assert "miniwecc" in done.stdout

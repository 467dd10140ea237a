"""The files of the image: what no container engine is needed to see."""

import importlib.metadata
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml
from packaging.requirements import Requirement
from packaging.version import Version

import tieline
from tieline.cli import app
from tieline.experiment.load import load_experiment

CHECKOUT = Path(__file__).resolve().parents[1]
PROJECT: dict[str, Any] = tomllib.loads((CHECKOUT / "pyproject.toml").read_text("utf-8"))
DOCKERFILE = (CHECKOUT / "docker" / "Dockerfile").read_text("utf-8")
PIN = re.compile(r"^([\w.-]+)==(\S+) \\$", re.MULTILINE)


def pins(name: str) -> dict[str, Version]:
    """Return the versions that a lock file names."""
    text = (CHECKOUT / "docker" / f"{name}.lock").read_text("utf-8")
    return {package: Version(version) for package, version in PIN.findall(text)}


@pytest.mark.parametrize(
    ("lock", "wanted"),
    [
        ("requirements", PROJECT["project"]["dependencies"]),
        ("build", PROJECT["build-system"]["requires"]),
    ],
)
def test_every_requirement_is_pinned_to_a_version_that_it_allows(
    lock: str, wanted: list[str]
) -> None:
    """The image would fail to start, or run with versions that the project rules out."""
    pinned = pins(lock)
    for requirement in map(Requirement, wanted):
        assert requirement.name in pinned
        assert pinned[requirement.name] in requirement.specifier, requirement.name


def test_whatever_a_pinned_package_needs_is_pinned_too() -> None:
    """`--require-hashes` refuses a package that the lock leaves out, at build time only."""
    pinned = pins("requirements")
    for name, version in pinned.items():
        try:
            installed = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        if Version(installed.version) != version:
            continue
        for requirement in map(Requirement, installed.requires or ()):
            environment = {
                "python_version": "3.12",
                "python_full_version": "3.12.12",
                "extra": "",
            }
            if requirement.marker is None or requirement.marker.evaluate(environment):
                needed = re.sub(r"[-_.]+", "-", requirement.name).lower()
                assert pinned[needed] in requirement.specifier, f"{name} needs {requirement}"


def test_the_image_has_a_python_that_the_project_supports() -> None:
    """Otherwise the package could not be installed in it; a floating tag would change by itself."""
    (version,) = re.findall(r"^ARG PYTHON=python:(\d+\.\d+\.\d+)-slim-\w+$", DOCKERFILE, re.M)
    (wanted,) = [Requirement(f"python{PROJECT['project']['requires-python']}")]
    assert version in wanted.specifier


def test_what_the_image_copies_is_in_its_context() -> None:
    """A path left out by .dockerignore fails the build."""
    ignore = (CHECKOUT / ".dockerignore").read_text("utf-8").splitlines()
    kept = {line.removeprefix("!") for line in ignore if line.startswith("!")}
    copied = [
        source
        for line in re.findall(r"^COPY (?!--from)(.+)$", DOCKERFILE, re.M)
        for source in line.split()[:-1]
    ]
    assert set(copied) == kept
    assert all((CHECKOUT / source).exists() for source in copied)


def test_compose_runs_this_release_with_one_experiment_for_all() -> None:
    """Sides of one run that differ in release or settings refuse each other."""
    compose = yaml.safe_load((CHECKOUT / "docker" / "compose.yaml").read_text("utf-8"))
    services = compose["services"]
    assert {service["image"] for service in services.values()} == {f"tieline:{tieline.__version__}"}
    sides = [services[name]["command"] for name in ("broker", "grid", "network")]
    assert len({(side[1], *(word for word in side if "--set" in word)) for side in sides}) == 1
    (host,) = [w.removeprefix("--host=") for w in sides[0] if w.startswith("--host=")]
    assert services["broker"]["networks"]["federation"]["ipv4_address"] == host
    assert all(f"--broker={host}:23404" in side for side in sides[1:])


@pytest.mark.parametrize("name", ["broker", "grid", "network", "gather", "recorder"])
def test_each_service_gives_a_command_that_the_program_takes(name: str) -> None:
    """A renamed option would end every container at its start."""
    compose = yaml.safe_load((CHECKOUT / "docker" / "compose.yaml").read_text("utf-8"))
    words = [
        re.sub(r"\$\{\w+:-(\w+)\}", r"\1", word) for word in compose["services"][name]["command"]
    ]
    group = typer.main.get_command(app)
    assert isinstance(group, typer.core.TyperGroup)
    command = group.commands[words[0]]
    assert command.make_context(words[0], words[1:]).params


def test_the_recorders_experiment_in_the_compose_file_is_a_valid_one(tmp_path: Path) -> None:
    """It stands in the compose file, where no other test would read it."""
    compose = yaml.safe_load((CHECKOUT / "docker" / "compose.yaml").read_text("utf-8"))
    path = tmp_path / "recorder.yaml"
    path.write_text(compose["configs"]["recorder"]["content"], encoding="utf-8")
    (guest,) = load_experiment(str(path)).points[0].experiment.federation.guests
    assert guest.units == ("G34",)

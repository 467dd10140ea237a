"""The checks of an installation: what they say when all is well, and when it is not."""

import importlib.metadata
import re
import sys
from pathlib import Path

import pytest

import tieline
from tieline.doctor import Finding, checks, examine
from tieline.errors import CosimError


def test_a_sound_installation_passes_the_quick_checks() -> None:
    """Otherwise the doctor would send a healthy user away."""
    quick = [check for check in checks.CHECKS if check is not checks.federation]
    findings = list(examine(quick))
    assert {finding.name for finding in findings} >= {"Python", "HELICS", "ports", "extra dask"}
    assert not [finding for finding in findings if finding.level == "fail"]
    assert all(finding.text for finding in findings)


@pytest.mark.helics
def test_a_federation_runs_here() -> None:
    """Otherwise the doctor would pass a computer on which nothing runs."""
    finding = checks.federation()
    assert finding.level == "ok", finding.text
    assert finding.text.startswith("broker, grid and network over zmq: 2 s in")


def test_a_federation_that_fails_is_told_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the most telling check would say nothing."""

    def fail(*_: object) -> None:
        raise CosimError("grid: died\n  | last words")

    monkeypatch.setattr("tieline.experiment.plan.prepare", fail)
    finding = checks.federation()
    assert (finding.level, finding.text) == ("fail", "grid: died")
    assert "tieline run" in finding.advice


@pytest.mark.parametrize(("version", "level"), [((3, 10), "fail"), ((3, 12), "ok")])
def test_a_python_outside_the_supported_ones_fails(
    monkeypatch: pytest.MonkeyPatch, version: tuple[int, int], level: str
) -> None:
    """Otherwise an error deep in a package would be the first sign."""
    monkeypatch.setattr(sys, "version_info", (*version, 0, "final", 0))
    assert checks.python_version().level == level


def test_helics_of_another_version_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a broken time contract would be looked for in tieline."""
    monkeypatch.setattr(importlib.metadata, "version", lambda _: "3.4.0")
    finding = checks.helics_version()
    assert finding.level == "warn"
    assert f"pip install helics=={checks.HELICS}" in finding.advice


def test_the_version_asked_for_is_the_one_that_is_pinned() -> None:
    """Otherwise doctor and installation would ask for two releases."""
    project = Path(tieline.__file__).parents[2] / "pyproject.toml"
    pins = re.findall(r'"helics==([\d.]+)"', project.read_text(encoding="utf-8"))
    assert pins == [checks.HELICS]


def test_a_missing_extra_is_no_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise every plain installation would look broken."""
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert checks.extra("ns3") == Finding(
        "extra ns3",
        "ok",
        "not installed",
        "only for network.engine ns3: pip install 'tieline[ns3]'",
    )


def test_one_core_or_little_memory_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a slow computer would be taken for a fault of tieline."""
    monkeypatch.setattr(checks, "cores", lambda: 1)
    monkeypatch.setattr(checks, "available_bytes", lambda: 300_000_000)
    assert checks.processors().level == "warn"
    assert checks.memory().level == "warn"

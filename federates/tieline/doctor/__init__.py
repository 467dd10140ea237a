"""Checks an installation: what it has, what it lacks, and whether a federation runs here."""

from tieline.doctor.checks import CHECKS, Check, Finding, examine

__all__ = ["CHECKS", "Check", "Finding", "examine"]

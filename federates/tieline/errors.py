"""The one exception tree; each class carries the exit code that the command line returns for it."""

from collections.abc import Iterable


class TielineError(Exception):
    """Anything that tieline refuses or that stopped a run."""

    exit_code = 1


_LONGEST_FINDING = 2_000


class InputError(TielineError):
    """What the user can fix: a parameter, a case table, an experiment file.

    Attributes:
        findings: every problem found, one sentence each; the message is their list. A sentence of
            more than 2,000 characters, which repeats what some file holds, loses its middle.
    """

    exit_code = 2

    def __init__(self, findings: str | Iterable[str]) -> None:
        self.findings: tuple[str, ...]
        stated = (findings,) if isinstance(findings, str) else tuple(findings)
        self.findings = tuple(map(_shortened, stated))
        super().__init__("\n".join(self.findings))


class NumericalError(TielineError):
    """The mathematics failed: power flow diverged, no rest at the start, a value not finite."""

    exit_code = 3


class CosimError(TielineError):
    """The federation failed: a federate died, a contract was broken, a message was malformed."""

    exit_code = 4


class TimeContractBroken(CosimError):
    """A grant, a delivery or a frame came at a time that the contract forbids."""


class FrameError(CosimError):
    """Bytes that are not the frame that they should be."""


def _shortened(finding: str) -> str:
    if len(finding) <= _LONGEST_FINDING:
        return finding
    half = _LONGEST_FINDING // 2
    return f"{finding[:half]} ... {finding[-half:]}"

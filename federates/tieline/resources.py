"""Finds the shipped cases and experiments: in a checkout, an editable install or a wheel."""

from pathlib import Path

from tieline.errors import InputError


def shipped(kind: str) -> Path:
    """Return the folder of what tieline ships of one kind.

    Args:
        kind: `cases` or `configs`.

    Raises:
        InputError: the installation holds neither.
    """
    package = Path(__file__).resolve().parent
    for folder in (package / "_data" / kind, package.parent.parent / kind):
        if folder.is_dir():
            return folder
    raise InputError(f"tieline's {kind} are missing beside {package}: reinstall tieline")


def case_folder(name: str) -> Path:
    """Return the folder of a case given by a shipped name or by the path of a folder.

    Raises:
        InputError: there is no such case; the message lists the shipped ones.
    """
    for folder in (shipped("cases") / name, Path(name)):
        if is_file(folder / "case.yaml"):
            return folder.resolve()
    known = sorted(path.parent.name for path in shipped("cases").glob("*/case.yaml"))
    shown = ", ".join(known)
    raise InputError(f"no case '{name}': give one of {shown}, or a folder with a case.yaml")


def is_file(path: Path) -> bool:
    """Return whether a path leads to a file, whatever text it was made of."""
    try:
        return path.is_file()
    except OSError:
        # A name that is too long, or leads through a folder that is closed.
        return False


def is_endless(path: Path) -> bool:
    """Return whether a path leads to what can be read without end: a device, a pipe or a socket."""
    try:
        return path.exists() and not (path.is_file() or path.is_dir())
    except OSError:
        # Whoever reads it says what is wrong with it.
        return False

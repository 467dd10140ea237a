"""The reference page of all commands: `python -m tieline.cli.reference` prints it."""

from collections.abc import Iterator
from typing import Any

import typer

from tieline.cli.app import app

HEAD = """# Commands

Made by `python -m tieline.cli.reference` from what each command declares.

"""


def as_markdown() -> str:
    """Return the page: a section a command, with its arguments and options."""
    return HEAD + "\n\n".join(_sections(typer.main.get_command(app), "tieline")) + "\n"


def _sections(group: Any, before: str) -> Iterator[str]:
    for name, command in group.commands.items():
        if command.hidden:
            continue
        path = f"{before} {name}"
        if hasattr(command, "commands"):
            yield f"## {path}\n\n{_text(command.help)}"
            yield from _sections(command, path)
        else:
            yield _section(command, path)


def _section(command: Any, path: str) -> str:
    shown = [parameter for parameter in command.params if parameter.name != "help"]
    arguments = [_name(parameter) for parameter in shown if _is_argument(parameter)]
    usage = " ".join([path, *arguments, *["[OPTIONS]"] * (len(arguments) < len(shown))])
    parts = [f"## {path}", _text(command.help), f"    {usage}"]
    if shown:
        parts.append("\n".join(["| | |", "|---|---|", *map(_row, shown)]))
    return "\n\n".join(parts)


def _row(parameter: Any) -> str:
    default = parameter.default
    is_said = default not in (None, False, "", []) and not callable(default)
    about = f"{parameter.help or ''}{f' [{default}]' if is_said else ''}"
    cells = (cell.replace("|", "\\|") for cell in (f"`{_name(parameter)}`", about))
    return f"| {' | '.join(cells)} |"


def _name(parameter: Any) -> str:
    if _is_argument(parameter):
        name = parameter.metavar or parameter.name.upper()
        return name if parameter.required else f"[{name}]"
    flags = ", ".join([*parameter.opts, *parameter.secondary_opts])
    return flags if parameter.is_flag else f"{flags} {parameter.metavar or 'VALUE'}"


def _is_argument(parameter: Any) -> bool:
    return bool(parameter.param_type_name == "argument")


def _text(text: str | None) -> str:
    return "\n".join(line.strip() for line in (text or "").strip().splitlines())


if __name__ == "__main__":
    print(as_markdown(), end="")  # noqa: T201

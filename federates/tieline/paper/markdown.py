"""The verdicts as a Markdown table, for the documentation."""

from collections.abc import Sequence

from tieline.paper.reproduce import Result, counted
from tieline.paper.sources import SOURCES
from tieline.paper.statement import Row

HEAD = ("id", "statement", "here", "stated", "verdict", "why", "source")


def markdown(results: Sequence[Result]) -> str:
    """Return a line of counts, one table an item, and the sources, in Markdown."""
    parts = [f"{counted(results)}."]
    for result in results:
        lines = [f"### {result.item.title}", "", _line(HEAD), _line(["---"] * len(HEAD))]
        lines += [_line(_cells(row)) for row in result.rows]
        parts.append("\n".join(lines))
    sources = [f"- {source.name}: {source.what}." for source in SOURCES]
    parts.append("\n".join(["### Where the statements were read", "", *sources]))
    return "\n\n".join(parts) + "\n"


def _cells(row: Row) -> list[str]:
    statement = row.statement
    return [
        f"`{statement.id}`",
        statement.text,
        row.ours,
        statement.paper,
        row.verdict.value,
        row.why,
        statement.source.name,
    ]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"

"""The page of a reproduction: one HTML file that opens from disk, every figure in it."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from string import Template

from tieline.paper.reproduce import FIGURES, Result, count, counted
from tieline.paper.sources import PAPER, SOURCES
from tieline.paper.statement import Row, Verdict

PAGE = "index.html"

CLASSES = {Verdict.REPRODUCED: "yes", Verdict.DIFFERENT: "partly", Verdict.NOT: "no"}


def write_page(results: Sequence[Result], target: Path, about: str) -> Path:
    """Write the page into the target and return its file.

    Args:
        results: what came of each item.
        target: the folder, whose figures are there.
        about: how it was made: version, form, wall time.
    """
    template = Template((Path(__file__).with_name("page.html")).read_text(encoding="utf-8"))
    text = template.substitute(
        paper=_safe(PAPER),
        about=_safe(about),
        counted=_safe(counted(results)),
        counts=" ".join(
            f'<span class="badge {CLASSES[verdict]}">{number} {verdict.value}</span>'
            for verdict, number in count(results).items()
        ),
        rows="\n".join(_table_row(row) for result in results for row in result.rows),
        items="\n".join(_section(result, target / FIGURES) for result in results),
        sources="\n".join(
            f"<li><b>{_safe(source.name)}</b>: {_safe(source.what)}.</li>" for source in SOURCES
        ),
    )
    path = target / PAGE
    path.write_text(text, encoding="utf-8")
    return path


def _table_row(row: Row) -> str:
    cells = [
        f'<a href="#{_safe(row.item)}">{_safe(row.statement.id)}</a>',
        _safe(row.statement.text),
        _safe(row.ours),
        _safe(row.statement.paper),
        _badge(row.verdict),
        _safe(row.why),
        _safe(row.statement.source.name),
    ]
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _section(result: Result, figures: Path) -> str:
    item = result.item
    drawn = "\n".join(
        _figure(figures / f"{name}.png", caption) for name, caption in result.captions.items()
    )
    failed = f'<p class="failed">Not computed: {_safe(str(result.error))}</p>'
    said = "\n".join(
        f"<li>{_badge(row.verdict)} {_safe(row.statement.text)}"
        f'<div class="numbers">here <b>{_safe(row.ours)}</b>, stated '
        f"<b>{_safe(row.statement.paper)}</b> ({_safe(row.statement.source.name)})</div>"
        f'<div class="why">{_safe(row.why)}</div></li>'
        for row in result.rows
    )
    return (
        f'<section id="{_safe(item.id)}"><h2>{_safe(item.title)}</h2>'
        f"<p><b>Shown in the paper:</b> {_safe(item.shows)}. "
        f"<b>Computed here:</b> {_safe(item.computed)}.</p>{failed if result.error else ''}"
        f'<div class="beside"><div>{drawn}</div><ul>{said}</ul></div></section>'
    )


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{_safe(caption)}">'
        f"<figcaption>{_safe(caption)}</figcaption></figure>"
    )


def _badge(verdict: Verdict) -> str:
    return f'<span class="badge {CLASSES[verdict]}">{verdict.value}</span>'


def _safe(text: str) -> str:
    return html.escape(text)

"""A page with curves over time, drawn as SVG: it opens in any browser and needs nothing else."""

from collections.abc import Mapping
from html import escape
from pathlib import Path

from cell.commands.errors import CommandError
from cell.commands.pages.svg_chart import Chart, svg

_STYLE = "body{font:14px sans-serif;margin:2em;max-width:960px}svg{border:1px solid #ccc}text{font:11px sans-serif}"


def write_page(file: Path, text: str) -> None:
    """Write a page. Raises `CommandError` where nothing can be written, and for names of other kinds of files."""
    if file.suffix.lower() not in (".html", ".htm"):
        raise CommandError(f"{file}: what is written is a page in HTML", f"name a file like {file.stem}.html")
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CommandError(
            f"{file} cannot be written: {error.strerror}", "name a file in a folder that exists"
        ) from error


def page(title: str, summary: list[str], charts: list[Chart], lists: Mapping[str, list[str]] | None = None) -> str:
    """The HTML text of a page; `lists` by their titles come after the charts, empty ones are left out."""
    items = _items(summary)
    listed = "".join(
        f"<h2>{escape(name)}</h2><ul>{_items(lines)}</ul>" for name, lines in (lists or {}).items() if lines
    )
    drawn = "".join(f"<h2>{escape(chart.title)}</h2>{svg(chart)}" for chart in charts)
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1><ul>{items}</ul>{drawn}{listed}</body></html>\n"
    )


def _items(lines: list[str]) -> str:
    return "".join(f"<li>{escape(line)}</li>" for line in lines)

"""Sphinx extension: every page with code cells is also a notebook of the same source."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from myst_nb.core.read import read_myst_markdown_notebook
from myst_parser.config.main import MdParserConfig
from sphinx.application import Sphinx

from contactlib.base.writing import write_whole

FOLDER = "notebooks"
LINK = '<p class="notebook"><a href="{}" download>Download this page as a notebook</a></p>'
ROLE = re.compile(r"\{py:\w+\}`~?([^`]+)`")  # which a notebook shows as it stands
UNTITLED = re.compile(r"\[\]\(([^)#]+)\)")  # a link to a page, which is shown with its title


def notebook_of(path: Path) -> Any:
    """Notebook of a page's source: its cells, with roles as plain code and links as titles."""

    def title(link: re.Match[str]) -> str:
        text = (path.parent / link[1]).read_text(encoding="utf-8")
        return f"*{next(line for line in text.splitlines() if line.startswith('# '))[2:]}*"

    config = MdParserConfig(enable_extensions={"colon_fence", "dollarmath"})
    text = ROLE.sub(r"`\1`", UNTITLED.sub(title, path.read_text(encoding="utf-8")))
    found = read_myst_markdown_notebook(text, config=config)
    found.metadata.pop("source_map", None)
    return found


def has_cells(app: Sphinx, page: str) -> bool:
    """Whether a page has cells that run."""
    path = Path(app.env.doc2path(page)) if page in app.env.found_docs else None
    return path is not None and "```{code-cell}" in path.read_text(encoding="utf-8")


def add_link(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Put the link above a page's text."""
    if has_cells(app, page):
        address = f"{'../' * page.count('/')}{FOLDER}/{page}.ipynb"
        context["body"] = LINK.format(address) + context["body"]


def write_notebooks(app: Sphinx, error: Exception | None) -> None:
    """Write the notebooks beside the site."""
    if error is not None or app.builder.format != "html":
        return
    for page in app.env.found_docs:
        if has_cells(app, page):
            found = notebook_of(Path(app.env.doc2path(page)))
            path = Path(app.outdir, FOLDER, f"{page}.ipynb")
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, json.dumps(found, indent=1).encode())


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("html-page-context", add_link)
    app.connect("build-finished", write_notebooks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

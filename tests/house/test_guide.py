"""The guide: its pages run, its links lead somewhere, and its site needs no network."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from urllib.parse import unquote, urldefrag

import pytest
from tree import installed

import contactlib as cl
from contactlib.files.sections import LAWS

GUIDE = Path(__file__).resolve().parents[2] / "docs"
PAGES = sorted(GUIDE.rglob("*.md"))
FIRST = GUIDE / "index.md"


class Links(HTMLParser):
    """Anchors of a page, what it links to, and what it loads."""

    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.loaded: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value for name, value in attrs if value}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.add(given["href"])
        elif tag in ("link", "script", "img", "iframe", "source"):
            self.loaded |= {given[name] for name in ("href", "src") if name in given}


@cache
def read(page: Path) -> Links:
    links = Links()
    links.feed(page.read_text(encoding="utf-8"))
    return links


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(GUIDE)))
def test_code_of_a_page_can_be_read(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    cells = re.findall(r"^```\{code-cell\}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    assert text.count("```{code-cell}") == len(cells)
    assert bool(cells) == text.startswith("---\nfile_format: mystnb\n")  # else nothing of it runs
    for cell in cells:
        if not cell.startswith("%%"):  # else it is a file
            compile(cell.removeprefix("%matplotlib inline\n"), page.name, "exec")


def test_the_page_of_names_has_all_that_are_on_top() -> None:
    text = (GUIDE / "reference" / "python" / "index.md").read_text(encoding="utf-8")
    listed = re.findall(r"`(\w+)`", text[text.index("| if you") : text.index("| subpackage")])
    on_top = [name for name in dir(cl) if not isinstance(getattr(cl, name), ModuleType)]
    assert sorted(set(listed) - {"cl"}) == on_top


def links_of(page: Path) -> set[Path]:
    """Pages to which a page's text or a list in it leads; the site's menu does not count."""
    text = page.read_text(encoding="utf-8")
    if page == FIRST:
        readme = (GUIDE.parent / "README.md").read_text(encoding="utf-8").replace("](docs/", "](")
        text += readme[readme.index("## Where to start") : readme.index("- **I want to change it")]
    shown = re.findall(r"```\{toctree\}\n:maxdepth.*?\n\n(.*?)```", text, re.DOTALL)
    found = re.findall(r"\]\(([^)#\s]+\.md)", text)
    found += [f"{name}.md" for name in " ".join(shown).split()]
    return {(page.parent / name).resolve() for name in found} & set(PAGES)


def test_every_page_is_two_clicks_from_the_first() -> None:
    near = links_of(FIRST)
    assert set(PAGES) - near.union({FIRST}, *map(links_of, near)) == set()


@pytest.mark.parametrize(
    "word",
    ["sign convention", "troubleshooting", "glossary", "cite", "Excel", "Jupyter", "chatter"],
)
def test_a_word_that_readers_look_for_is_in_a_heading_or_on_the_first_page(word: str) -> None:
    texts = (page.read_text(encoding="utf-8") for page in PAGES)
    headings = re.findall("^# .*|^## .*", "\n".join(texts), re.MULTILINE)
    assert word.lower() in "\n".join([*headings, FIRST.read_text(encoding="utf-8")]).lower()


STATED = {  # largest errors of a force against CONTACT, wherever the guide has them
    "../README.md": r"within ([\d.]+) with .*without spin; with spin \| 1e-12; fitted \| ([\d.]+);",
    "explanation/validation.md": r"\| spin, alone .*? \| ([\d.]+) .*"
    r"\| both, 30 degrees \| ([\d.]+) ",
    "howto/lateral_spin.md": r"right to ([\d.]+) of .*, and to ([\d.]+) without",
    "explanation/speed.md": r"constant friction \| 0.\d+ us \| 0.\d+ us \| ([\d.]+) \|"
    r".*without spin \| 0.\d+ us \| 0.\d+ us \| ([\d.]+) ",
}


def test_a_number_that_stands_twice_is_one() -> None:
    found = {
        re.findall(p, (GUIDE / name).read_text("utf-8"), re.DOTALL)[0] for name, p in STATED.items()
    }
    assert len(found) == 1


def test_every_law_is_on_a_page() -> None:
    """Which its row in the list of kinds, made from its class, does not replace."""
    written = [page for page in PAGES if "reference" not in page.parts]
    text = "".join(page.read_text(encoding="utf-8") for page in written)
    assert [kind for kind in LAWS if f'"{kind}"' not in text] == []


@pytest.mark.slow
def test_site(tmp_path: Path) -> None:
    for library in ("furo", "myst_nb", "numpydoc", "sphinx_click"):
        pytest.importorskip(library)
    site = tmp_path / "site"
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        str(GUIDE),
        str(site),
    ]
    # From an installation, beside which there is no tree, as the README says to build it.
    package = installed(tmp_path / "site-packages")
    environment = os.environ | {"PYTHONPATH": str(package.parent)}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = sorted(site.rglob("*.html"))
    assert {p.relative_to(GUIDE).with_suffix(".html") for p in PAGES} <= {
        p.relative_to(site) for p in pages
    }
    for page in pages:
        for name in read(page).loaded:
            assert not re.match(r"\w+:(?!image/)|//", name), f"{page} loads {name}"
        for link in read(page).links:
            if re.match(r"\w+:", link):
                continue
            name, anchor = map(unquote, urldefrag(link))
            target = page.parent / name if name else page
            assert target.is_file(), f"{page} links to {link}"
            assert not anchor or anchor in read(target).anchors, f"{page} links to {link}"


def test_tables_of_the_reference_are_those_of_the_code() -> None:
    pytest.importorskip("numpydoc")
    tables = runpy.run_path(str(GUIDE / "tables.py"))
    pages = list(tables["pages"]())
    assert len(pages) >= 4
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert tables["filled"](text) == text, f"python {GUIDE / 'tables.py'} writes it anew"

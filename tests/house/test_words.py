"""Words that the glossary in CONTRIBUTING.md replaces do not return: names, texts and messages."""

from __future__ import annotations

import os
import re
from pathlib import Path

from tree import FOLDERS, ROOT

KINDS = {".c", ".h", ".html", ".inc", ".md", ".mo", ".py", ".toml", ".ts"}
PATTERNS = {  # and what to write
    r"\b(MOST|LEAST)_[A-Z]": "MAX_, MIN_",
    r"(?i)\bmost bytes\b": "file size limit",
    r"(?i)\bstranger": "untrusted",
    r"(?i)\bwitness": "reference solver",
    r"(?i)\bruns? off\b": "diverges",
    r"(?i)(\brun(s|ning)?|\bran)[ _-]?away": "slips away, slip-away",
    r"(?i)\bfeel each other": "are coupled",
    r"(?i)\bforces? in the plane\b|\bin[ _-]plane\b": "lateral and spin force",
    r"(?i)\bhot[ _](friction|strips?|curves?)\b|\bis_hot\b": "thermal softening, thermal_",
    # Polach's area of adhesion, titles of papers and an outcome's name keep the word.
    r"(?i)(?<!re-)(?<!area of )\badhesion\b(?!$|[\"'_]| (utili|limit|control|model|char|\|))": (
        "creep force, friction available"
    ),
    r"(?i)\bof which\b": "a sentence of its own",
    r"\b(told|said)\b": "message, error, output; reported; a subject that acts",
    r"(?i)\b(wants|wanted|asks for|asked for)\b": "needs, requires, demands, requested",
    r"(?i)\b(file|law|table|test|number)s? (says?|tells?|knows?)\b": "has, contains",
    r"\bknows? (no|nothing)\b": "has no, does not depend on",
    r"\b(does|do) not mind\b": "ignores",
    r"\b[Aa]s of (an?|the|`)": "as for, as in",
    r"\bto be had\b": "available",
    r"\b(is|are) none\b|\bno one place\b": "invalid, undefined, or: expected X, got Y",
    r"\bis there already\b": "already exists",
    r"(?i)\bpoints' distance\b": "fit residual",
    r"\bmust rise\b|\bnumbers that rise\b": "must be strictly increasing",
}


def files() -> list[Path]:
    """All files of the project, without those that tools generate."""
    pages = [*ROOT.glob("*.md")]
    for name in FOLDERS:
        for folder, below, names in os.walk(ROOT / name):
            below[:] = [one for one in below if one not in ("node_modules", "__pycache__")]
            pages += [Path(folder) / one for one in (*below, *names)]
    return pages


def test_plain_words() -> None:
    texts = [p for p in files() if p.suffix in KINDS]
    assert len(texts) > 300
    naming = ("CONTRIBUTING.md", "docs/reference/glossary.md")  # the words that others use
    left_out = {Path(__file__).resolve(), *map(ROOT.joinpath, naming)}
    wrong = []
    for path in texts:
        if path in left_out or path.name == "explorer.html":  # a page that is built
            continue
        text = path.read_text(encoding="utf-8")
        for pattern, instead in PATTERNS.items():
            for word in re.finditer(pattern, text, re.MULTILINE):
                line = 1 + text.count("\n", 0, word.start())
                wrong.append(f"{path}:{line}: {word[0]!r}: write {instead}")
    assert wrong == []


def test_plain_names_of_files() -> None:
    for path in files():
        for pattern, instead in PATTERNS.items():
            assert not re.search(pattern, path.name), f"{path}: write {instead}"

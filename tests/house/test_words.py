"""Words that the glossary in CONTRIBUTING.md replaces do not return: names, texts and messages."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (
    "benchmarks",
    "contactlib",
    "docs",
    "examples",
    "explorer",
    "fmu",
    "models",
    "tests",
    "tools",
)
KINDS = {".c", ".h", ".html", ".md", ".mo", ".py", ".toml", ".ts"}
PATTERNS = {  # and what to write
    r"\b(MOST|LEAST)_[A-Z]": "MAX_, MIN_",
    r"(?i)\bstranger": "untrusted",
    r"(?i)\bwitness": "reference solver",
    r"(?i)\bruns? off\b": "diverges",
    r"(?i)\bfeel each other": "are coupled",
    r"(?i)\bof which\b": "a sentence of its own",
    r"\b(told|said)\b": "message, error, output, reported; a subject that acts",
    r"\b(is|are|was) wanted\b": "a subject that acts",
    r"\bto be had\b": "available",
    r"\b(is|are) none\b": "invalid, undefined, or: expected X, got Y",
    r"(?i)\bpoints' distance\b": "fit residual",
    r"\bmust rise\b|\bnumbers that rise\b": "must be strictly increasing",
}


def test_plain_words() -> None:
    pages = [*ROOT.glob("*.md"), *(p for name in FOLDERS for p in (ROOT / name).rglob("*"))]
    texts = [p for p in pages if p.suffix in KINDS and "node_modules" not in p.parts]
    assert len(texts) > 300
    left_out = {Path(__file__).resolve(), ROOT / "CONTRIBUTING.md"}  # which name the words
    for path in texts:
        if path in left_out or path.name == "explorer.html":  # a page that is built
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            for pattern, instead in PATTERNS.items():
                found = re.search(pattern, line)
                assert not found, f"{path}:{number}: {found and found[0]!r}: write {instead}"

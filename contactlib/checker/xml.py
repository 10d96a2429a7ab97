"""Read XML, and hold it against the schemas that come with FMPy."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
from lxml import etree

SCHEMAS = Path(fmpy.__file__).parent / "schema"


def parse(data: bytes) -> Any:
    """Root element.

    Raises
    ------
    ValueError
        If `data` is not well formed, or has a document type.
    """
    # An FMU comes from anywhere: read nothing but what it holds, and expand nothing in it.
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise ValueError(f"is not well-formed XML: {' '.join(str(error).split())}") from None
    # FMPy, which is asked later, expands entities.
    if root.getroottree().docinfo.internalDTD is not None:
        raise ValueError("must be without a document type (<!DOCTYPE ...>)")
    return root


def violations(root: Any, schema: str) -> Iterator[str]:
    """What in the document violates the schema, with line numbers."""
    checked = _schema(schema)
    if not checked.validate(root):
        for error in checked.error_log:
            yield f"line {error.line}: {' '.join(error.message.split())}"


@cache
def _schema(name: str) -> Any:
    return etree.XMLSchema(file=str(SCHEMAS / name))


def is_true(value: str | None) -> bool:
    """Whether an attribute says true, in either way that XML has."""
    return value in ("true", "1")

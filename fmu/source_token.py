"""The token that ties a library, and the descriptions of FMUs with it, to its C sources."""

from __future__ import annotations

import hashlib
from pathlib import Path

SOURCES = Path(__file__).resolve().parent
FOLDERS = ("kernel", "fmi")


def source_token() -> str:
    """Digest of the C sources, whatever their line ends."""
    digest = hashlib.sha256()
    paths = (path for folder in FOLDERS for path in (SOURCES / folder).iterdir())
    sources = (path for path in paths if path.suffix in (".c", ".h", ".inc"))
    for path in sorted(sources, key=lambda path: path.name):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:32]

"""Put the explorer page together, and compile its kernel.

    python explorer/build_page.py           # writes contactlib/export/explorer.html and .wasm
    python explorer/build_page.py --check   # only checks whether they are up to date

`contactlib explore` puts the kernel, the tables and a model into the page when it writes it.

Both are the same to the last byte wherever they are built: the compilers' versions are those of
the extra "explorer" and of package-lock.json.
"""

from __future__ import annotations

import sys
import zlib
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from html import escape
from pathlib import Path

from bundle import bundle, check_types, install, licences
from declarations import declarations
from structs import struct_fields, write_types
from wasm import FUNCTIONS, compile_kernel

from contactlib.base.writing import package_folder, write_whole
from contactlib.export.explorer import DATA, KERNEL, PAGE, PLACES, json_text

SOURCE = Path(__file__).resolve().parent
MODELS = ("roller_rig", "locomotive")


def json_element(name: str, data: object) -> str:
    """An element that nothing runs, for what the script reads by its id."""
    return DATA.format(name, json_text(data))


def policy(script: str, style: str) -> str:
    """Content security policy: this script and this style, no connection to anywhere."""

    def source(text: str) -> str:
        digest = b64encode(sha256(text.encode()).digest())
        return f"'sha256-{digest.decode()}'"

    parts = [
        "default-src 'none'",
        f"script-src {source(script)} 'wasm-unsafe-eval'",
        f"style-src {source(style)}",
        "img-src data:",
        "base-uri 'none'",
        "form-action 'none'",
    ]
    return f'<meta http-equiv="Content-Security-Policy" content="{"; ".join(parts)}">'


def model_texts() -> Mapping[str, str]:
    """The shipped model files that the page begins with, by name."""
    folder = package_folder("models")
    return {name: (folder / f"{name}.toml").read_text(encoding="utf-8") for name in MODELS}


def licence_element(licence: tuple[str, str]) -> str:
    """Name and text of a licence, as they are."""
    return f"<pre>{escape(chr(10).join((licence[0], '', licence[1])))}</pre>"


def data_elements() -> str:
    """All that the script reads by its id; the command fills the last ones."""
    elements = [
        json_element("declarations", declarations()),
        json_element("structs", struct_fields()),
        json_element("models", model_texts()),
        *(json_element(name, None) for name in PLACES),
    ]
    return "\n".join(elements)


def page() -> str:
    """The whole page, if its modules have no type errors."""
    write_types(FUNCTIONS, declarations()["sections"])
    check_types()
    script, style = bundle()
    text = (SOURCE / "index.html").read_text(encoding="utf-8")
    parts = {
        "policy": policy(script, style),
        "style": f"<style>{style}</style>",
        "licences": "".join(map(licence_element, licences().items())),
        "data": data_elements(),
        "script": f"<script>{script}</script>",
    }
    for name, part in parts.items():
        before, mark, after = text.partition(f"<!-- {name} -->")
        if not mark:
            raise SystemExit(f"index.html must have a place for the {name}: <!-- {name} -->")
        text = before + part + after
    return text


def is_current(path: Path, data: bytes) -> bool:
    """Whether a file is there and holds this; versions of zlib compress differently."""
    if not path.is_file():
        return False
    found = path.read_bytes()
    return found == data or (path == KERNEL and zlib.decompress(found) == zlib.decompress(data))


def main(arguments: list[str]) -> str | None:
    """Write page and kernel, or compare them; returns an error message."""
    checking = arguments == ["--check"]
    if arguments and not checking:
        return __doc__
    install()
    for path, data in ((PAGE, page().encode()), (KERNEL, zlib.compress(compile_kernel(), 9))):
        if not checking:
            print(write_whole(path, data))
        elif not is_current(path, data):
            command = "python explorer/build_page.py"
            return f"{path.name} differs from what the sources give: '{command}' writes it again"
    return None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""The replay as a page: one HTML file that needs nothing beside it, neither network nor server.

The assets lie in ``page/``. Its scripts are ES modules that import each other, so that Node and editors read them as
they are; inlined, they are one module, without their imports and exports.
"""

import base64
import html
import json
import re
import zlib
from collections.abc import Sequence
from pathlib import Path

from uuv_marl.atomic import write_text
from uuv_marl.replay.encode import payload
from uuv_marl.replay.recording import Recording

MOST_EPISODES = 4
"""Side by side on one page."""

_ASSETS = Path(__file__).parent / "page"
_DECODER = Path(__file__).parent / "decode.js"
_MODULE_WORDS = re.compile(r"^(?:import .*? from \"[^\"]+\";\n|export )", re.MULTILINE)


def write_page(recordings: Sequence[Recording], path: Path) -> None:
    """Write ``page_html`` to a file, whole or not at all. Raises ResultsError where it can't be written."""
    write_text(path, page_html(recordings))


def page_html(recordings: Sequence[Recording]) -> str:
    """One to four episodes side by side, as a page that requests nothing.

    Raises:
        ValueError: there are none, or more than four.
    """
    if not 1 <= len(recordings) <= MOST_EPISODES:
        raise ValueError(f"a page shows 1 to {MOST_EPISODES} episodes, got {len(recordings)}; make several pages")
    policies = ", ".join(recording.policy for recording in recordings)
    parts = {
        "title": html.escape(f"{recordings[0].scenario.name}: {policies}"),
        "style": _asset("uPlot.min.css") + "\n" + _asset("page.css"),
        "licence": html.escape(_asset("uPlot.LICENSE")),
        "episodes": json.dumps(payload(recordings), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        "uplot": _deflated(_asset("uPlot.iife.min.js")),
        "scripts": _scripts(),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], _asset("page.html"))


def _asset(name: str) -> str:
    return (_ASSETS / name).read_text(encoding="utf-8")


def _deflated(text: str) -> str:
    """As ``inflate`` of ``decode.js`` reads it."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return base64.b64encode(deflate.compress(text.encode()) + deflate.flush()).decode("ascii")


def _scripts() -> str:
    """The page's own modules as one; ``app.js`` comes last, for it runs what the others define."""
    modules = sorted(_ASSETS.glob("*.js"), key=lambda path: path.name == "app.js")
    own = [path for path in modules if not path.name.startswith("uPlot")]
    return "\n".join(_MODULE_WORDS.sub("", path.read_text(encoding="utf-8")) for path in [_DECODER, *own])

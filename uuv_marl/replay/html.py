"""The replay page as one HTML file that needs no network and no server, from episodes that are encoded already.

Its assets are in ``page/``. The scripts are ES modules, which are inlined as one module without imports and exports.
"""

import base64
import html
import json
import re
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_ASSETS = Path(__file__).parent / "page"
_DECODER = Path(__file__).parent / "decode.js"
_MODULE_WORDS = re.compile(r"^(?:import [^;]*;\n|export )", re.MULTILINE)


def html_of(data: Mapping[str, Any]) -> str:
    """The page of episodes that are encoded as a ``payload``."""
    parts = {
        "title": html.escape(title_of(data)),
        "style": f"{_asset('uPlot.min.css')}\n{_asset('page.css')}",
        "licence": html.escape(_asset("uPlot.LICENSE")),
        "episodes": json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        "uplot": deflated(_asset("uPlot.iife.min.js").encode()),
        "scripts": _scripts(),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _asset("page.html"))


def title_of(data: Mapping[str, Any]) -> str:
    """Scenario and policies of encoded episodes."""
    episodes = data["episodes"]
    return f"{episodes[0]['scenario']}: {', '.join(episode['policy'] for episode in episodes)}"


def _asset(name: str) -> str:
    return (_ASSETS / name).read_text(encoding="utf-8")


def deflated(data: bytes) -> str:
    """Compressed data in base64, for ``inflate`` of ``decode.js``."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS, 6, zlib.Z_FILTERED)
    return base64.b64encode(deflate.compress(data) + deflate.flush()).decode("ascii")


def _scripts() -> str:
    """The page's own modules as one, last ``app.js``, which uses the others."""
    own = [path for path in sorted(_ASSETS.glob("*.js")) if not path.name.startswith(("app", "uPlot"))]
    modules = [_DECODER, *own, _ASSETS / "app.js"]
    return "\n".join(_MODULE_WORDS.sub("", path.read_text(encoding="utf-8")) for path in modules)

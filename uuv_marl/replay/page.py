"""The replay as a page: one HTML file that needs nothing beside it, neither network nor server.

The assets lie in ``page/``. Its scripts are ES modules that import each other, so that Node and editors read them as
they are; inlined, they are one module, without their imports and exports.
"""

import base64
import html
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from uuv_marl.atomic import write_text
from uuv_marl.errors import ReplayError
from uuv_marl.paths import UserPath, user_path
from uuv_marl.replay import MOST_EPISODES
from uuv_marl.replay.encode import payload
from uuv_marl.replay.recording import Recording

_ASSETS = Path(__file__).parent / "page"
_DECODER = Path(__file__).parent / "decode.js"
_MODULE_WORDS = re.compile(r"^(?:import [^;]*;\n|export )", re.MULTILINE)


def page_html(recordings: Sequence[Recording]) -> str:
    """One to four episodes side by side, as a page that requests nothing.

    Raises:
        ReplayError: there are none, or more than four.
    """
    return html_of(_coded(recordings))


def html_of(data: Mapping[str, Any]) -> str:
    """The page of episodes that are coded as a ``payload``."""
    parts = {
        "title": html.escape(_title(data)),
        "style": f"{_asset('uPlot.min.css')}\n{_asset('page.css')}",
        "licence": html.escape(_asset("uPlot.LICENSE")),
        "episodes": json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        "uplot": _deflated(_asset("uPlot.iife.min.js")),
        "scripts": _scripts(),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _asset("page.html"))


def write_page(recordings: Sequence[Recording], path: UserPath) -> None:
    """Write ``page_html`` to a file, whole or not at all. Raises ResultsError where it can't be written."""
    write_text(user_path(path), page_html(recordings))


class Replay:
    """Episodes that a notebook shows where this object is a cell's value: the page, in a frame of its own.

    Args:
        recordings: one to four.
        height_px: of the frame.
    """

    def __init__(self, recordings: Sequence[Recording], height_px: int = 640) -> None:
        data = _coded(recordings)
        self._page, self._title = html_of(data), _title(data)
        self._height_px = height_px

    def __repr__(self) -> str:
        return f"Replay of {self._title}"

    def _repr_html_(self) -> str:
        return (
            f'<iframe title="{html.escape(self._title)}" sandbox="allow-scripts" width="100%" '
            f'height="{self._height_px}" style="border: 0" srcdoc="{html.escape(self._page)}"></iframe>'
        )


def _coded(recordings: Sequence[Recording]) -> dict[str, Any]:
    if not 1 <= len(recordings) <= MOST_EPISODES:
        raise ReplayError(f"a page shows 1 to {MOST_EPISODES} episodes, got {len(recordings)}; make several pages")
    return payload(recordings)


def _title(data: Mapping[str, Any]) -> str:
    episodes = data["episodes"]
    return f"{episodes[0]['scenario']}: {', '.join(episode['policy'] for episode in episodes)}"


def _asset(name: str) -> str:
    return (_ASSETS / name).read_text(encoding="utf-8")


def _deflated(text: str) -> str:
    """As ``inflate`` of ``decode.js`` reads it."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return base64.b64encode(deflate.compress(text.encode()) + deflate.flush()).decode("ascii")


def _scripts() -> str:
    """The page's own modules as one; ``app.js`` comes last, for it runs what the others define."""
    own = [path for path in sorted(_ASSETS.glob("*.js")) if not path.name.startswith(("app", "uPlot"))]
    modules = [_DECODER, *own, _ASSETS / "app.js"]
    return "\n".join(_MODULE_WORDS.sub("", path.read_text(encoding="utf-8")) for path in modules)

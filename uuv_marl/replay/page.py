"""The replay as one HTML file that needs no network and no server.

Its assets are in ``page/``. The scripts are ES modules, which are inlined as one module without imports and exports.
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
    """One to four episodes side by side, as a self-contained page.

    Raises:
        ReplayError: there are none, or more than four.
    """
    return html_of(_coded(recordings))


def html_of(data: Mapping[str, Any]) -> str:
    """The page of episodes that are encoded as a ``payload``."""
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
    """Write ``page_html`` to a file atomically. Raises ResultsError where it can't be written."""
    write_text(user_path(path), page_html(recordings))


class Replay:
    """Episodes that a notebook shows as a page in a frame, as the value of a cell.

    Args:
        recordings: one to four.
        height_px: height of the frame.
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
    """Compressed text for ``inflate`` of ``decode.js``."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return base64.b64encode(deflate.compress(text.encode()) + deflate.flush()).decode("ascii")


def _scripts() -> str:
    """The page's own modules as one, last ``app.js``, which uses the others."""
    own = [path for path in sorted(_ASSETS.glob("*.js")) if not path.name.startswith(("app", "uPlot"))]
    modules = [_DECODER, *own, _ASSETS / "app.js"]
    return "\n".join(_MODULE_WORDS.sub("", path.read_text(encoding="utf-8")) for path in modules)

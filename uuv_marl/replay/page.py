"""Recordings as a replay page: a file, or a cell's value in a notebook."""

import html
from collections.abc import Sequence
from typing import Any

from uuv_marl.atomic import write_text
from uuv_marl.errors import ReplayError
from uuv_marl.paths import UserPath, user_path
from uuv_marl.replay import MOST_EPISODES
from uuv_marl.replay.encode import payload
from uuv_marl.replay.html import html_of, title_of
from uuv_marl.replay.recording import Recording


def page_html(recordings: Sequence[Recording]) -> str:
    """One to four episodes side by side, as a self-contained page.

    Raises:
        ReplayError: there are none, or more than four.
    """
    return html_of(_coded(recordings))


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
        self._page, self._title = html_of(data), title_of(data)
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

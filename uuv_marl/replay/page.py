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


def write_page(recordings: Sequence[Recording], path: UserPath) -> None:
    """Write one to four episodes side by side as a self-contained page, atomically.

    Raises:
        ReplayError: there are no recordings, or more than four.
        ResultsError: the file can't be written.
    """
    write_text(user_path(path), html_of(_coded(recordings)))


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

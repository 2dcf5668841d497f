"""Films and stills of recorded episodes by the environments' renderer: MP4, GIF and PNG, without a display."""

import importlib
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from uuv_marl.atomic import replacing, writing
from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import CAMERAS
from uuv_marl.envs.drawing.frame import Panel, draw_frame, pixels
from uuv_marl.errors import ReplayError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.replay import FILMS, MOST_EPISODES
from uuv_marl.replay.recording import Recording

Picture = NDArray[np.uint8]
_LENGTH_S, _HOLD_S = {".mp4": 20.0, ".gif": 10.0}, 2.0
"""Duration of a film without a given speed, and of its last picture [s]."""
_FPS = {".mp4": 20, ".gif": 8}
_MOMENTS = 4
"""Number of moments that a still shows side by side."""


def write_film(
    recordings: Sequence[Recording], path: UserPath, *,
    camera: str = "follow", sonar_of: int | None = None, speed: float | None = None,
    size: tuple[int, int] | None = None, progress: Callable[[float], object] | None = None,
) -> None:  # fmt: skip
    """Write a film of episodes side by side with a common clock; or, as PNG, a still with several moments.

    A GIF has no trails and no grid, which would double its size.

    Args:
        recordings: one to four.
        path: a file ``.mp4``, ``.gif`` or ``.png``, which is written atomically.
        camera: ``follow`` or ``map``.
        sonar_of: index of a vehicle whose sonar is shown; the recordings must hold its inspection.
        speed: seconds of the episode in each second of the film; None for a film of 20 s, or a GIF of 10 s.
        size: width and height [px]; by default according to the format.
        progress: called with the finished share, 0 to 1.

    Raises:
        ReplayError: an argument is invalid.
        ResultsError: the file can't be written.
        MissingExtraError: the extra ``render`` is not installed.
    """
    path = user_path(path)
    suffix = check_format(path)
    if not 1 <= len(recordings) <= MOST_EPISODES:
        raise ReplayError(f"a film shows 1 to {MOST_EPISODES} recordings side by side, got {len(recordings)}")
    if camera not in CAMERAS:
        raise ReplayError(f"camera must be one of {list(CAMERAS)}, got {camera!r}")
    if speed is not None and not speed > 0.0:
        raise ReplayError(f"speed must be positive, got {speed}")
    if size is not None and not all(320 <= side <= 4096 and side % 2 == 0 for side in size):
        raise ReplayError(f"size must be width and height, even numbers of pixels from 320 to 4096, got {size}")
    longest = max(float(recording.time_s[-1]) for recording in recordings)
    size = size or _size(suffix, len(recordings))
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial:
        shown = dict.fromkeys(
            f"{one.scenario.name}, {one.scenario.swarm.num_vehicles} vehicles, seed {one.seed}" for one in recordings
        )
        heading = "; ".join(shown)
        if suffix == ".png":
            moments = np.linspace(0.0, longest, _MOMENTS).tolist()
            scenes = [(one, one.scene_at(now, sonar_of), now) for one in recordings for now in moments]
            panels = [Panel(one.policy, scene, now) for one, scene, now in scenes]
            heading += f", at {', '.join(f'{now:.0f}' for now in moments)} s"
            still = pixels(draw_frame(panels, size, camera, heading, columns=_MOMENTS))
            Image.fromarray(still).save(partial, optimize=True)
            return
        is_gif, fps, speed = suffix == ".gif", _FPS[suffix], speed or max(1.0, round(longest / _LENGTH_S[suffix]))
        heading += f", {speed:.3g} times as fast" if speed != 1.0 else ""
        num = int(np.ceil(longest / speed * fps)) + 1

        def pictures() -> Iterator[Picture]:
            for k in range(num):
                scenes = [one.scene_at(k * speed / fps, sonar_of) for one in recordings]
                panels = [
                    Panel(one.policy, scene._replace(trail=[]) if is_gif else scene)
                    for one, scene in zip(recordings, scenes, strict=True)
                ]
                yield pixels(draw_frame(panels, size, camera, heading, columns=len(panels), grid=not is_gif))
                if progress:
                    progress((k + 1) / num)

        (_write_gif if is_gif else _write_mp4)(partial, pictures(), fps)


def check_format(path: Path) -> str:
    """The suffix of a path. Raises ReplayError or MissingExtraError where this format can't be written."""
    suffix = path.suffix.lower()
    if suffix not in FILMS:
        raise ReplayError(f"{path} must end in {', '.join(FILMS[:-1])} or {FILMS[-1]}")
    if suffix == ".mp4":
        _av()
    return suffix


def _size(suffix: str, num: int) -> tuple[int, int]:
    """Size of the whole picture [px]; a GIF fits a page of GitHub."""
    if suffix == ".png":
        return 1320, 450 * num
    across = ((560, 414, 276, 206) if suffix == ".gif" else (800, 640, 480, 400))[num - 1]
    return across * num, across + 140


def _write_gif(path: Path, pictures: Iterator[Picture], fps: int) -> None:
    """Write a GIF with one palette of few colours for all frames, which compresses static parts."""
    palette = Image.new("P", (1, 1))
    palette.putpalette([part for colour in ink.palette() for part in colour])
    frames = [Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    durations = [round(1000 / fps)] * (len(frames) - 1) + [round(1000 * _HOLD_S)]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=durations, loop=0, optimize=True)


def _write_mp4(path: Path, pictures: Iterator[Picture], fps: int) -> None:
    """Write an MP4 in H.264, which all browsers play."""
    av = _av()
    last = first = next(pictures)
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=fps, options={"crf": "23", "preset": "veryfast"})
        stream.height, stream.width, stream.pix_fmt = *first.shape[:2], "yuv420p"
        for last in chain([first], pictures):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(last, format="rgb24")))
        for _ in range(round(_HOLD_S * fps)):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(last, format="rgb24")))
        container.mux(stream.encode())


def _av() -> Any:
    """Import PyAV, the encoder."""
    with extra("render", "an .mp4"):
        return importlib.import_module("av")

"""Write docs/gallery.md, its films and the recorded demo: ``python tools/make_gallery.py [NAME ...]``."""

import json
import sys
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from uuv_marl.replay import demo
from uuv_marl.replay.encode import payload
from uuv_marl.replay.film import write_film
from uuv_marl.replay.record import record
from uuv_marl.scenario import load_scenario

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "gallery"
SIZE, LASTS_S, COLUMNS = (400, 480), 4.0, 3
"""Size of a film [px], its duration [s], and the number of films side by side."""
_DATA = tomllib.loads(Path(__file__).with_name("gallery.toml").read_text(encoding="utf-8"))


class Film(NamedTuple):
    """An episode to show."""

    title: str
    words: str
    """Description of the film."""
    scenario: str
    policy: str
    seed: int = 10_100
    kind: str = ""
    """Kind of map."""
    camera: str = "follow"

    @property
    def name(self) -> str:
        """Name of the file."""
        return "-".join(filter(None, (self.scenario, self.kind)))


FILMS = [Film(**table) for table in _DATA["film"]]


def page() -> str:
    """The text of docs/gallery.md."""
    cells = [
        f"**{film.title}**<br>![{film.title}](gallery/{film.name}.gif)<br>{film.words} `{film.policy}`"
        for film in FILMS
    ]
    rows = [" | ".join(cells[k : k + COLUMNS]) for k in range(0, len(cells), COLUMNS)]
    head = f"| {' | '.join([' '] * COLUMNS)} |\n|{' --- |' * COLUMNS}\n"
    return f"# Gallery\n{_DATA['text']}\n\n{head}" + "".join(f"| {row} |\n" for row in rows)


def main() -> None:
    """Write the page, and all films and the demo, or those named."""
    (ROOT / "docs" / "gallery.md").write_text(page(), encoding="utf-8")
    if len(sys.argv) == 1 or "demo" in sys.argv[1:]:
        episodes = [record(load_scenario(demo.SCENARIO), policy, demo.SEED) for policy in demo.POLICIES]
        demo.RECORDED.write_text(
            json.dumps(payload(episodes), allow_nan=False, separators=(",", ":")), encoding="utf-8"
        )
    for film in FILMS:
        if len(sys.argv) == 1 or film.name in sys.argv[1:]:
            changes: dict[str, Any] = {"task.kinds": [film.kind]} if film.kind else {}
            recording = record(load_scenario(film.scenario, overrides=changes), film.policy, film.seed)
            path, speed = FOLDER / f"{film.name}.gif", max(1.0, float(recording.time_s[-1]) / LASTS_S)
            write_film([recording], path, camera=film.camera, size=SIZE, speed=speed)
            print(f"{film.name}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()

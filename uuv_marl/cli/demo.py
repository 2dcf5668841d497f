"""``uuv-marl demo``: a recording of three policies on one hard map."""

import json
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

from uuv_marl.cli.console import explained, path_option, say


def demo(
    output: Annotated[Path, path_option("The page to write, an .html file.")] = Path("uuv_marl_demo.html"),
) -> None:
    """Show three policies on one hard map: a recorded replay as an HTML page, opened in the browser if there is one.

    Example: uuv-marl demo --output demo.html
    """
    with explained():
        from uuv_marl.atomic import write_text
        from uuv_marl.replay.demo import POLICIES, RECORDED, SCENARIO, SEED
        from uuv_marl.replay.html import html_of

        write_text(output, html_of(json.loads(RECORDED.read_text(encoding="utf-8"))))
        say(f"Recorded replay, to open in a browser: {output} ({output.stat().st_size / 1000:,.0f} kB)")
        if sys.stdout.isatty():
            webbrowser.open(output.resolve().as_uri())
        policies = " ".join(f"--policy {policy}" for policy in POLICIES)
        say("Simulate it yourself, or with another --seed (compiles for about a minute at first):")
        say(f"uuv-marl replay --scenario {SCENARIO} {policies} --seed {SEED}")

"""The command that shows an episode again."""

import shlex
from collections.abc import Sequence


def command(scenario: str, policy: str, seed: int, overrides: Sequence[str] = ()) -> str:
    """The ``uuv-marl replay`` command that simulates an episode again, quoted for a shell."""
    sets = [part for text in overrides for part in ("--set", text)]
    return shlex.join(["uuv-marl", "replay", "--scenario", scenario, "--policy", policy, "--seed", str(seed), *sets])

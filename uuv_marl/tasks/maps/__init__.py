"""Maps of hard water, drawn by seed: closed water with banks, and walls of discs of one kind in it, one file a kind."""

from uuv_marl.tasks.maps.bar import Bar
from uuv_marl.tasks.maps.forest import Forest
from uuv_marl.tasks.maps.gate import Gate
from uuv_marl.tasks.maps.harbour import Harbour
from uuv_marl.tasks.maps.maze import Maze
from uuv_marl.tasks.maps.piles import Piles
from uuv_marl.tasks.maps.pocket import Pocket

KINDS = {
    "pocket": Pocket, "bar": Bar, "gate": Gate, "forest": Forest, "maze": Maze, "harbour": Harbour, "piles": Piles,
}  # fmt: skip
"""Every kind of map, a section of numbers with ``walls``."""

__all__ = ["KINDS", "Bar", "Forest", "Gate", "Harbour", "Maze", "Piles", "Pocket"]

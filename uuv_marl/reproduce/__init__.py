"""The paper again: its figures, its numbers beside ours, and what lies beyond them."""

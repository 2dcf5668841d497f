"""``scout``: the safest hand-made law here."""

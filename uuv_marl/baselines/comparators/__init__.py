"""Laws from published equations, and one that only pulls."""

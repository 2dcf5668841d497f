"""Controllers from published equations, and proportional tracking."""

"""The cost of disturbances: axes of rising severity, success at each level, scores."""

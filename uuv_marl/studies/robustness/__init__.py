"""What disturbances of the sea cost: axes of rising severity, success at each level, scores."""

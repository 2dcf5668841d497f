"""Episodes to look at: recorded once, then shown in a browser or as a film."""

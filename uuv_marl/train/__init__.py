"""Training: each module is named after the library that it trains with, an extra of its own."""

"""The paper's controller, and our reconstructions of the two comparators that it names."""

"""Hard water: how often laws and learners come through, tier by tier and kind by kind."""

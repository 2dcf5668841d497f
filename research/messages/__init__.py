"""How much a message may say, how often, and how many may be lost: a study of policies that send messages."""

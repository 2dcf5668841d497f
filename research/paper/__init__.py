"""What the paper says: its cases, figures 7 to 15, Table 2, sentences, and a ledger of how far ours agree."""

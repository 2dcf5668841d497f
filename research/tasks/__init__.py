"""Tasks beyond the paper: results of controllers and networks by scenario and kind of map."""

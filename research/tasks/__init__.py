"""Tasks beyond the paper: what laws and networks reach, scenario by scenario and map by map."""

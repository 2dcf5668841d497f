"""Tasks beyond the paper: what laws and a plain learner reach, scenario by scenario and map by map."""

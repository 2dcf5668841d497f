"""Purposes of an episode's random numbers, one for each draw, so that disturbances never change each other's."""

DIRECTION, GUST, EDDY_PLACE = 1, 2, 3
MISMATCH, VICTIM, ONSET = 10, 11, 12
BEARING_RANGE, FACTOR, DETECTION, SILENCE, FALSE_ECHO, FALSE_PLACE = 20, 21, 22, 23, 24, 25
DRIFT, COMPASS = 30, 31
MESSAGE = 40
MOVER, MOVER_DIRECTION = 50, 51

"""Simulation: vehicles, trajectory, obstacles and sonar, as compiled loops over arrays (world, vehicle, ...).

``Swarm`` is its interface. Arguments of compiled functions have the same names and meanings everywhere:

==========================  =========================================================================================
``w``, ``i``, ``j``         Index of the world; of the vehicle that moves or listens; of another vehicle.
``k``, ``a``, ``f``         Index of the sub-sector; of the array, or of the active sub-sector; of the fault.
``p``, ``q``                Entries of ``cells``; ``q`` is also a detection.
``num``                     Number of valid entries or rows, from the first on.
``tick``, ``key``           Control steps since the reset; key of the episode (``Swarm.keys``).
``world``, ``state``        ``arrays.World`` and its part ``State``, likewise ``world_map``, ``facts`` and ``senses``.
``model``, ``rules``        Constants of the scenario (``model.Model``) and their parts, likewise ``plant``, ``suite``.
``workspace``, ``now``      Working arrays of a thread (``workspace.Workspace``): the world's vehicles as columns,
``cells``, ``listener``     the living sorted by cell, and one listener. ``buffers``: the same of all threads.
``grid``                    Geometry of the cells.
``see``, ``more``           Fields of all percepts by name, views of ``senses.percept``; ``DisturbanceFields``.
``alive``                   False for lost vehicles, shape (world, vehicle).
``action``                  Shares of full force, body frame, shape (world, vehicle, 2).
``x``, ``y``, ``c``, ``s``  North and east [m]; cosine and sine of the heading. ``pose`` holds the four.
``*_x``, ``*_y``            Components of a vector: north and east, or ahead and to starboard.
``hull``                    Each vehicle's own parameters and faults (``disturbances.actuation.Hull``).
``disturbances``, ``d``     ``disturbances.disturbances.Disturbances``, or None; its parts ``water``, ``noise_model``,
                            are constants, ``flow``, ``errors``, ``readings``, ... are arrays.
``at``                      Start of each field in a percept; in a reading, the reading (``schedule.Reading``).
==========================  =========================================================================================

A function's docstring says what it returns and which arrays it writes.
"""

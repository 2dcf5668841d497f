"""The water: vehicles, trajectory, obstacles and sonar, as compiled loops over arrays (world, vehicle, ...).

``Swarm`` is its interface. Arguments of compiled functions have the same names and the same meaning everywhere:

==========================  =========================================================================================
``w``, ``i``, ``j``         Index of the world; of the vehicle that moves or listens; of another vehicle.
``k``, ``a``, ``f``         Index of the sub-sector; of the array, or of the active sub-sector; of the fault.
``p``, ``q``                Entries of ``cells``, whose order is that of place; ``q`` is also a hit.
``num``                     How many entries or rows count, from the first on.
``tick``, ``key``           Control holds since the reset; the key of the episode (``Swarm.keys``).
``world``, ``state``        ``arrays.World`` and its part ``State``, likewise ``course``, ``facts`` and ``senses``.
``model``, ``rules``        The scenario's numbers (``model.Model``) and their parts, likewise ``plant`` and ``suite``.
``workspace``, ``now``      What a thread works with (``workspace.Workspace``): the world's vehicles as columns,
``cells``, ``ear``          the living sorted by cell, and one listener. ``room``: the same of all threads.
``grid``                    Where the cells lie.
``see``, ``more``           Fields of all percepts by name, views of ``senses.percept``; those of the sea's channels.
``alive``                   False for lost vehicles, shape (world, vehicle).
``action``                  Shares of full force, body frame, shape (world, vehicle, 2).
``x``, ``y``, ``c``, ``s``  North and east [m]; cosine and sine of the heading. ``pose`` holds the four.
``*_x``, ``*_y``            Parts of a vector: north and east, or ahead and to starboard.
``hull``                    Radius of a hull [m]; in the sea, what each vehicle is like (``sea.actuation.Hull``).
``sea``                     What disturbs the worlds (``sea.sea.Sea``), None for nothing. Its parts have their names:
                            ``water``, ``noise``, ... are numbers, ``flow``, ``track``, ``readings``, ... are arrays.
``at``                      The reading of an array (``sea.schedule.Reading``).
==========================  =========================================================================================

A function's text says what it computes and what it writes.
"""

"""The paper's equations a second time, by another hand: as short as they can be, in NumPy, whatever it costs.

Nothing here is imported from ``uuv_marl.sim``, so that a mistake there is not made here.
"""

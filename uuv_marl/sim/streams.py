"""States of random generators as arrays, for snapshots of worlds."""

from collections.abc import Sequence

import numpy as np

from uuv_marl.types import UInt64

_LOW = 2**64 - 1


def packed(streams: Sequence[np.random.Generator | None]) -> UInt64:
    """States of NumPy's default generators (PCG64), shape (stream, 6); zeros for None."""
    rows = np.zeros((len(streams), 6), np.uint64)
    for row, stream in zip(rows, streams, strict=True):
        if stream is not None:
            whole = stream.bit_generator.state
            state, inc = whole["state"]["state"], whole["state"]["inc"]
            row[:] = (state & _LOW, state >> 64, inc & _LOW, inc >> 64, whole["has_uint32"], whole["uinteger"])
    return rows


def unpacked(rows: UInt64, num: int) -> list[np.random.Generator | None]:
    """``num`` generators that continue from ``packed`` states. Raises ValueError if the array doesn't fit."""
    if rows.shape != (num, 6) or rows.dtype != np.uint64:
        raise ValueError(f"streams must be uint64 of shape ({num}, 6), got {rows.dtype} of shape {rows.shape}")
    streams: list[np.random.Generator | None] = []
    for low, high, inc_low, inc_high, has_half, half in rows.tolist():
        stream = np.random.default_rng(0)
        stream.bit_generator.state = {
            "bit_generator": "PCG64",
            "state": {"state": low | high << 64, "inc": inc_low | inc_high << 64},
            "has_uint32": has_half,
            "uinteger": half,
        }
        streams.append(stream if inc_low else None)  # a PCG's increment is odd
    return streams

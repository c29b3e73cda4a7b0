"""What stands for an array, as one of NumPy's."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def floats(name: str, given: Any) -> Floats:
    """As numbers; a mask would be lost, and no ``None`` is a number."""
    if given is None:
        raise TypeError(f"{name} is None; numbers are wanted")
    if np.ma.is_masked(given):
        raise ValueError(f"{name} has masked values; fill them or leave them out")
    return np.asarray(given, dtype=np.float64)

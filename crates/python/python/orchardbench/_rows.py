"""Results of many environments, one environment at a time."""

from __future__ import annotations

from typing import Any

import numpy as np


def row_of(info: dict[str, Any], k: int) -> dict[str, Any]:
    """What the info of many environments says of environment ``k``, as the info of a single one; ``final_obs`` and ``final_info`` are left out."""
    kept = (key for key in info if not key.startswith("_") and key not in ("final_obs", "final_info"))
    return {key: row_of(info[key], k) if isinstance(info[key], dict) else _plain(info[key][k]) for key in kept}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value

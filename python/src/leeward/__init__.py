"""Plan fleets of drones out of each other's downwash; check, fly and replan plans; find what
physics a simulation of recordings leaves out.

World frame throughout: metres, z up; times in seconds from the plan's beginning; a position is the
centre of a drone's rotor plane. Units stand at the end of names.

>>> import leeward
>>> air = leeward.Air("crazyflie-2.1")
>>> round(float(air.speed([[0.0, 0.0, -0.5]])[0]), 2)   # half a metre below it, m/s
3.64
"""

try:
    import numpy as _numpy  # noqa: F401
except ImportError:
    raise ImportError(
        "leeward needs numpy 1.24 or newer, which is not installed: pip install numpy"
    ) from None

from ._air import PRESETS, Air, Airframe, Separation, separation
from ._errors import (
    Blocked,
    ChangeError,
    Conflict,
    LeewardError,
    PlanError,
    Problem,
    RecordingError,
    ScenarioError,
)
from ._leeward import __version__
from ._plans import Check, DronePlan, Export, Flown, Plan, Violation, check, fly, plan
from ._recordings import (
    Calibration,
    Diagnosis,
    Simulation,
    calibrate,
    diagnose,
    simulate,
)
from ._ron import Name
from ._running import Late, Removed, Replanned, Retasked, Running, Task

__all__ = [
    "PRESETS",
    "Air",
    "Airframe",
    "Blocked",
    "Calibration",
    "ChangeError",
    "Check",
    "Conflict",
    "Diagnosis",
    "DronePlan",
    "Export",
    "Flown",
    "Late",
    "LeewardError",
    "Name",
    "Plan",
    "PlanError",
    "Problem",
    "RecordingError",
    "Removed",
    "Replanned",
    "Retasked",
    "Running",
    "ScenarioError",
    "Separation",
    "Simulation",
    "Task",
    "Violation",
    "__version__",
    "calibrate",
    "check",
    "diagnose",
    "fly",
    "plan",
    "separation",
    "simulate",
]

"""A plan changed while it is flown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Union

from . import _leeward
from ._errors import ChangeError
from ._plans import Plan, Violation
from ._ron import Scenario, text_of


@dataclass(frozen=True)
class Task:
    """A place to reach."""

    to_m: tuple[float, float, float]
    """Centre of the rotor plane (m)."""
    dwell_s: float = 0.0
    """How long to hover there (s)."""
    load_kg: float | None = None
    """Payload from there on (kg); ``None``: unchanged."""


@dataclass(frozen=True)
class Late:
    """A drone is behind its plan: where the plan had it ``by_s`` ago (s)."""

    drone: str
    by_s: float


@dataclass(frozen=True)
class Removed:
    """A drone is taken out, body and wake."""

    drone: str


@dataclass(frozen=True)
class Retasked:
    """A drone drops what it still had to do, and does this."""

    drone: str
    tasks: Sequence[Task]


Change = Union[Late, Removed, Retasked]


@dataclass(frozen=True)
class Replanned:
    """What became of some changes."""

    changed: list[dict[str, Any]]
    """The drones that have another trajectory now (``drone``), and why (``cause``)."""
    refused: list[dict[str, Any]]
    """The drones without a path, and why."""
    unavoidable: list[Violation]
    """Violations that begin before anything could be done about them."""


class Running:
    """A plan that is being flown. ``plan`` is always verified as a whole.

    ``scenario``: what the plan was made of; a plan by ``leeward.plan`` knows it. Raises
    ``ChangeError`` where the plan is not of that scenario.
    """

    def __init__(self, plan: Plan, scenario: Scenario | None = None) -> None:
        if not isinstance(plan, Plan):
            kind = type(plan).__name__
            raise TypeError(f"plan is a {kind}; a Plan is wanted: Plan.load reads one from a file")
        world = plan._world
        if scenario is not None:
            name, text, folder = text_of(scenario)
            world = _leeward.World((name, text), folder, None)
        if world is None:
            raise ChangeError("this plan was loaded; say of which scenario: Running(plan, scenario)")
        self._world = world
        self._running = _leeward.Running(world, plan._plan)

    @property
    def plan(self) -> Plan:
        """What has been flown and what will be."""
        return Plan(self._running.plan(), self._world)

    def replan(self, at_s: float, changes: Sequence[Change]) -> Replanned:
        """Plans on from a moment (s since the plan began) with these changes.

        Raises ``ChangeError`` with all that is wrong with them; then nothing has changed. Ctrl-C
        stops it, and ends this run.
        """
        if isinstance(changes, (Late, Removed, Retasked)):
            raise TypeError("changes is one change; a list of them is wanted")
        found = json.loads(self._running.replan(float(at_s), [_told(it) for it in changes]))
        return Replanned(
            changed=found["changed"],
            refused=found["refused"],
            unavoidable=[Violation._of(it) for it in found["unavoidable"]],
        )


def _told(change: Change) -> _leeward._Change:
    if not isinstance(change, (Late, Removed, Retasked)):
        raise TypeError(f"{change!r} is no change; a list of Late, Removed or Retasked is wanted")
    if isinstance(change, Late):
        return ("late", change.drone, float(change.by_s), [])
    if isinstance(change, Removed):
        return ("removed", change.drone, 0.0, [])
    tasks = [
        ([float(x) for x in it.to_m], float(it.dwell_s), it.load_kg) for it in change.tasks
    ]
    return ("retasked", change.drone, 0.0, tasks)

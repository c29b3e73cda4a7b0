"""What can be refused, as data."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with a scenario, a plan, a recording or a change."""

    message: str
    """What and who."""
    file: str | None = None
    """Where: the file, as it was named."""
    line: int | None = None
    """From 1."""
    column: int | str | None = None
    """Of a scenario or a plan the column from 1, of a table its name."""
    label: str | None = None
    """What to say at that place."""
    notes: tuple[str, ...] = field(default=())
    """What else one must know."""
    help: str | None = None
    """What would put it right."""


@dataclass(frozen=True)
class Conflict:
    """Two places, or a place and a zone, that exclude one another."""

    drone: str
    """The one exposed."""
    with_: str
    """The drone or zone in the way."""
    when: str
    """``starts``, ``goals``, or ``tasks`` at which both are at one time."""
    why: Any
    """How they exclude one another, with figures."""
    nearest_fix_m: tuple[float, float, float] | None
    """A place for the drone where this pair is in order (m)."""
    meeting: dict[str, Any] | None = None
    """Of ``tasks``: which of the drone's (``task``, from 1; ``None``: it stays at its start), the
    other's (``their_task``), and ``during_s``: from and until (s); ``None``: whenever the task is
    done."""


class LeewardError(Exception):
    """Anything that this package refuses."""


class _Listed(LeewardError, ValueError):
    def __init__(self, message: str, problems: tuple[Problem, ...] = ()) -> None:
        super().__init__(message)
        self.problems = problems
        """Each by itself, in the order of the text."""


class ScenarioError(_Listed):
    """A scenario that means nothing: ``problems`` has all that is wrong, each at its place."""


class PlanError(_Listed):
    """Not a plan, or none that can be flown; ``problems`` has all fields that are wrong."""


class RecordingError(_Listed):
    """A recording that cannot be read or judged; ``problems`` as far as they have a place."""


class ChangeError(_Listed):
    """Changes that cannot be; then nothing has changed."""


class Blocked(LeewardError):
    """No plan can be safe: starts exclude one another."""

    def __init__(self, message: str, conflicts: tuple[Conflict, ...] = (), more: int = 0) -> None:
        super().__init__(message)
        self.conflicts = conflicts
        """The pairs, and those of goals and tasks: all, or of very many the worst."""
        self.more = more
        """How many more pairs there are."""


_LISTED: dict[str, type[_Listed]] = {
    it.__name__: it for it in (ScenarioError, PlanError, RecordingError, ChangeError)
}


def made(name: str, message: str, entries: str) -> LeewardError:
    """An exception by its name; ``entries`` is a JSON list. Called by the extension."""
    found: list[dict[str, Any]] = json.loads(entries)
    if name == "Blocked":
        (whole,) = found
        return Blocked(message, tuple(map(_conflict, whole["conflicts"])), whole["more"])
    problems = tuple(Problem(**{**it, "notes": tuple(it.get("notes", ()))}) for it in found)
    return _LISTED[name](message, problems)


def _conflict(entry: dict[str, Any]) -> Conflict:
    fix = entry["nearest_fix_m"]
    return Conflict(
        drone=entry["drone"],
        with_=entry["with"],
        when=entry["when"],
        why=entry["why"],
        nearest_fix_m=None if fix is None else (fix[0], fix[1], fix[2]),
        meeting=entry["meeting"],
    )

"""Scenarios planned; plans as data; plans checked and flown."""

from __future__ import annotations

import hashlib
import html
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _leeward
from ._arrays import Floats, floats
from ._errors import PlanError
from ._ron import Scenario, text_of

if TYPE_CHECKING:
    import pandas as _pandas


@dataclass(frozen=True)
class Violation:
    """Something that a plan must not do."""

    kind: str
    """Which check: ``air``, ``collision``, ``column``, ... (docs/formats.md)."""
    drone: str
    with_: str | None
    """With whom or what."""
    from_s: float
    """First moment (s)."""
    until_s: float | None
    """Last moment (s); ``None``: until the end."""
    position_m: tuple[float, float, float]
    """Where the drone is at the worst moment (m)."""
    value: float
    """The worst value, in ``unit``."""
    limit: float
    unit: str

    @staticmethod
    def _of(entry: Mapping[str, Any]) -> Violation:
        x, y, z = entry["position_m"]
        return Violation(
            kind=entry["kind"],
            drone=entry["drone"],
            with_=entry.get("with"),
            from_s=entry["from_s"],
            until_s=entry["until_s"],
            position_m=(x, y, z),
            value=entry["value"],
            limit=entry["limit"],
            unit=entry["unit"],
        )


class DronePlan(Mapping[str, Any]):
    """One drone of a plan: its fields of plan.json, and where it is."""

    def __init__(self, plan: Plan, index: int, data: Mapping[str, Any]) -> None:
        self._plan, self._index, self._data = plan, index, data

    @property
    def name(self) -> str:
        return str(self._data["name"])

    @property
    def t_s(self) -> Floats:
        """Break points of its trajectory (s)."""
        return np.asarray(self._data["trajectory"]["t_s"], dtype=np.float64)

    def position(self, t_s: npt.ArrayLike) -> Floats:
        """Where it is at some times (s, finite): shape (n, 3), m; NaN where it has not come or has
        left."""
        times = np.atleast_1d(floats("t_s", t_s))
        if not np.isfinite(times).all():
            raise ValueError("t_s must be finite, every time of it")
        return self._plan._plan.positions(self._index, np.ascontiguousarray(times.ravel()))

    def __getitem__(self, key: str) -> Any:
        return self._data[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def __len__(self) -> int:
        return len(self._data)

    def __repr__(self) -> str:
        return f"DronePlan({self.name!r}, arrives_s={self._data['arrives_s']})"


def _restored(text: str, notes: list[str], untold: int, stated: str | None) -> Plan:
    plan = Plan(_leeward.Plan.restored(text, notes, untold))
    plan._stated = stated
    return plan


class Plan:
    """A verified plan: what plan.json holds (``data``), drones by name, positions as arrays."""

    def __init__(self, plan: _leeward.Plan, world: _leeward.World | None = None) -> None:
        self._plan, self._world = plan, world
        self.data: dict[str, Any] = json.loads(plan.json())
        """All of it, as docs/formats.md has it."""
        self.notes: list[str] = plan.notes
        """What to know of it: how cells were chosen, which rules were given up (docs/formats.md);
        of one that was loaded what was assumed."""
        self._stated: str | None = None
        drones = self.data["drones"]
        self._drones = {it["name"]: DronePlan(self, k, it) for k, it in enumerate(drones)}

    @staticmethod
    def load(path: Union[str, os.PathLike[str]]) -> Plan:
        """Reads a plan.json and judges it; raises ``PlanError`` where it is none.

        Its figures are what follows from its trajectories, but for ``may_be_late_s`` and what would
        take planning, which stay as stated; ``check`` names those that the file states and that
        differ.
        """
        text = _text_of(path)
        plan = Plan(_leeward.Plan.read(os.fspath(path), text))
        plan._stated = text
        return plan

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes; which waits are dwells, ``page`` says here alone."""
        return _restored, (self._plan.json(), self.notes, self.untold, self._stated)

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes it as a plan.json."""
        Path(path).write_text(self._text(), encoding="utf-8")

    def page(self) -> str:
        """It over time, as a page of one file that needs no network: the text of a plan.html."""
        return self._plan.page(self._world)

    def _text(self) -> str:
        return self._plan.json() + "\n"

    def export(
        self,
        to: str,
        folder: Union[str, os.PathLike[str]],
        *,
        georeference: tuple[float, float, float, float] | None = None,
        frame: str | None = None,
        rate_hz: float | None = None,
        own_origin: bool = False,
        compressed: bool = False,
        untimed_ok: bool = False,
    ) -> Export:
        """Writes it as other programs fly it, reads that back and measures it.

        ``to``: ``setpoints``, ``crazyswarm``, ``skybrush``, ``mcap``, ``czml`` or ``qgc``
        (docs/exchange.md). ``georeference``: latitude, longitude (deg), height above mean sea level
        (m) of (0, 0, 0) and heading of +x (deg, clockwise from north); ``czml`` and ``qgc`` need
        it. Of setpoints: ``frame`` (``ned``, which it is, or ``enu``), ``rate_hz`` (1/s; 20), and
        ``own_origin``: places count from each drone's start. ``compressed``: of ``crazyswarm`` the compressed form alone.
        ``untimed_ok``: ``qgc`` holds no times; write it all the same.

        The folder is made, and files of an earlier export in it are replaced. Raises ``PlanError``
        where the plan is not safe or a drone does not fit (``problems``: one for each), and where
        the folder holds what another command wrote, and ``ValueError`` for what says nothing of the
        format; then nothing is written.
        """
        # What was loaded is exported as its file has it, and called what `plan export` calls that.
        text = self._stated if self._stated is not None else self._text()
        plan_id = hashlib.sha256(text.encode()).hexdigest()[:16]
        setpoints = (frame, None if rate_hz is None else float(rate_hz), own_origin)
        other = _leeward.written_by_another(os.fspath(folder))
        if other is not None:
            raise PlanError(
                f"{os.fspath(folder)} holds what `{other[1]}` wrote ({other[0]}); name another folder"
            )
        only = (compressed, untimed_ok)
        manifest, contents = _leeward.export(text, (to, plan_id), georeference, setpoints, only)
        out = Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        main = out / "export.json"
        before = _files_of(json.loads(main.read_text("utf-8"))) if main.exists() else []
        files = [out / name for name, _ in contents]
        for path, (_, content) in zip(files, contents):
            path.write_bytes(content)
        main.write_text(manifest + "\n", encoding="utf-8")
        for old in (out / name for name in before if Path(name).name == name):
            if old not in files:
                old.unlink(missing_ok=True)
        return Export(data=json.loads(manifest), files=files)

    @property
    def status(self) -> str:
        """``safe``, ``partial`` (some drones have no path) or ``unsafe`` (not to be flown)."""
        return str(self.data["status"])

    @property
    def is_safe(self) -> bool:
        """Every drone is planned, and the verifier found nothing."""
        return self.status == "safe"

    @property
    def makespan_s(self) -> float:
        """When the last drone has arrived (s)."""
        return float(self.data["fleet"]["makespan_s"])

    @property
    def violations(self) -> list[Violation]:
        """What the verifier found; of a drone that collides with very many others the worst."""
        return [Violation._of(it) for it in self.data["violations"]]

    @property
    def untold(self) -> int:
        """How many more violations there are than ``violations`` has."""
        return self._plan.untold

    @property
    def names(self) -> list[str]:
        """Of all drones, in the scenario's order."""
        return list(self._drones)

    def __getitem__(self, name: str) -> DronePlan:
        return self._drones[name]

    def __iter__(self) -> Iterator[DronePlan]:
        return iter(self._drones.values())

    def __contains__(self, drone: object) -> bool:
        """Whether it has a drone of this name, or this drone."""
        return (isinstance(drone, str) and drone in self._drones) or any(it == drone for it in self)

    def __len__(self) -> int:
        return len(self._drones)

    def times(self, dt_s: float) -> Floats:
        """From 0 to the end of the last motion in steps of ``dt_s`` (s)."""
        if not 0.0 < dt_s < np.inf:
            raise ValueError(f"dt_s is {dt_s} s; it must be finite and above 0")
        last_s = max((float(it.t_s[-1]) for it in self if it.t_s.size), default=0.0)
        steps = np.arange(int(np.ceil(last_s / dt_s)) + 1)
        return np.asarray(steps * dt_s, dtype=np.float64)

    def samples(self, dt_s: float) -> tuple[Floats, Floats]:
        """Times (t,), s, and where all drones are then (drones, t, 3), m."""
        t_s = self.times(dt_s)
        return t_s, np.stack([it.position(t_s) for it in self])

    def to_pandas(self) -> _pandas.DataFrame:
        """A row a drone; needs pandas."""
        import pandas as pd

        skipped = {"trajectory", "airframe"}
        rows = [{k: v for k, v in it.items() if k not in skipped} for it in self]
        return pd.DataFrame(rows).set_index("name")

    def __repr__(self) -> str:
        return f"<Plan: {len(self)} drones, {self.status}, {self.makespan_s:.1f} s>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th>{html.escape(it.name)}</th><td>{it['arrives_s']:.2f}</td>"
            f"<td>{it['worst_air_mps']:.2f}</td></tr>"
            for it in list(self)[:40]
        )
        more = f"<p>and {len(self) - 40} more</p>" if len(self) > 40 else ""
        caption = f"{len(self)} drones, {html.escape(self.status)}, {self.makespan_s:.1f} s"
        head = "<tr><th>drone</th><th>arrives (s)</th><th>worst air (m/s)</th></tr>"
        return f"<table><caption>{caption}</caption>{head}{rows}</table>{more}"


@dataclass(frozen=True)
class Export:
    """A plan as other programs fly it: what export.json holds, and the files."""

    data: dict[str, Any]
    """All of it, as docs/exchange.md has it."""
    files: list[Path]
    """What was written beside export.json."""

    @property
    def deviation_m(self) -> float:
        """How far the files, read back, are from the plan at most (m)."""
        return float(self.data["deviation"]["largest_m"])

    @property
    def lost(self) -> list[str]:
        """What the plan says and the files do not."""
        return list(self.data["lost"])


def _files_of(manifest: Mapping[str, Any]) -> list[str]:
    of_drones = [name for drone in manifest.get("drones", []) for name in drone["files"]]
    return of_drones + list(manifest.get("files_of_all", []))


def plan(
    scenario: Scenario,
    *,
    seed: int | None = None,
    finding: Union[str, os.PathLike[str], None] = None,
    time_limit_s: float | None = None,
    contrast: bool = False,
) -> Plan:
    """Plans a scenario and verifies the plan.

    ``scenario``: a path, a text (RON), or a dict with the same keys. ``seed`` and ``finding`` (a
    file) take the place of the scenario's. With ``time_limit_s`` (s) it stops with the best so
    far; without it the same scenario gives the same plan. ``contrast``: plan once more as if there
    were no downwash, to say what ignoring it costs.

    Raises ``ScenarioError`` with every problem at its place, and ``Blocked`` where starts exclude
    one another. Ctrl-C stops it.
    """
    name, text, folder = text_of(scenario)
    cited = None if finding is None else os.fspath(finding)
    world = _leeward.World((name, text), folder, cited)
    return Plan(_leeward.plan(world, seed, time_limit_s, contrast), world)


@dataclass(frozen=True)
class Check:
    """What the verifier says of a plan."""

    violations: list[Violation]
    """All; of a drone that collides with very many others, or is in very many columns, the
    worst."""
    unplanned: list[dict[str, Any]]
    """Drones that stay at their starts, and why."""
    differences: list[dict[str, Any]]
    """Figures that the file states and that do not follow from its trajectories."""
    closest: dict[str, Any] | None
    """The two bodies that come nearest to one another."""
    worst_air: dict[str, Any] | None
    """The drone whose air comes nearest to its limit."""
    late: list[dict[str, Any] | None]
    """For each drone how late it may be, all others on time (s); where that was asked for."""
    untold: int = 0
    """How many more violations there are than ``violations`` has."""

    @property
    def is_safe(self) -> bool:
        """Nothing violated, every drone planned, every figure follows."""
        return not (self.violations or self.unplanned or self.differences)


def _text_of(path: Union[str, os.PathLike[str]]) -> str:
    try:
        # As it is: a plan is known by its bytes.
        return Path(path).read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        raise PlanError(
            f"{os.fspath(path)} is no text: a plan.json is wanted; "
            "shows and tables are read by `plan check`"
        ) from None


def check(plan: Union[Plan, str, os.PathLike[str]], *, late: bool = False) -> Check:
    """Judges a plan, or a plan.json, by the verifier alone.

    ``late``: also how late each drone may be, which takes longer. Raises ``PlanError``.
    """
    if isinstance(plan, Plan):
        path, text = None, plan._plan.json() if plan._stated is None else plan._stated
    else:
        path, text = os.fspath(plan), _text_of(plan)
    found = json.loads(_leeward.check(path, text, late))
    examined = found["examination"]
    return Check(
        violations=[Violation._of(it) for it in found["violations"]],
        unplanned=found["unplanned"],
        differences=examined["differences"],
        closest=examined["closest"],
        worst_air=examined["worst_air"],
        late=examined["late"],
        untold=examined["untold"],
    )


@dataclass(frozen=True)
class Flown:
    """A plan flown in closed loop: what flight.json holds."""

    data: dict[str, Any]

    @property
    def is_within_limits(self) -> bool:
        """No drone over its limit of air, none touches another or anything."""
        return bool(self.data["is_within_limits"])

    @property
    def flights(self) -> list[dict[str, Any]]:
        """One for each controller, feed-forward and speed of the air; ``drones`` has each drone."""
        flights: list[dict[str, Any]] = self.data["flights"]
        return flights

    def to_pandas(self) -> _pandas.DataFrame:
        """A row for each drone of each flight; needs pandas."""
        import pandas as pd

        cases = ("controller", "feed_forward", "convection")
        rows = [
            {**{case: it[case] for case in cases}, **drone}
            for it in self.flights
            for drone in it["drones"]
        ]
        return pd.DataFrame(rows)


def fly(
    plan: Plan,
    *,
    controllers: Sequence[str] = ("px4",),
    feed_forward: Sequence[str] = ("none",),
    convection: Sequence[float] = (),
    gusts: float | None = None,
    lean: bool = False,
    seed: int = 0,
    until_s: float | None = None,
) -> Flown:
    """Flies a plan in closed loop through late, gusty air.

    ``controllers``: of ``px4`` and ``research``; ``feed_forward``: of ``none``, ``paper``,
    ``late``, ``matched``; ``convection``: speeds of the air over that of the centreline, by default
    the plan's, else 1 and 0.6; ``gusts``: over the centreline speed, 0 for none; ``lean``: air
    leaves along the thrust; ``until_s``: only up to this time (s, from 0).
    """
    if not isinstance(plan, Plan):
        kind = type(plan).__name__
        raise TypeError(f"plan is a {kind}; a Plan is wanted: Plan.load reads one from a file")
    air = (gusts, lean, seed)
    cases = (list(controllers), list(feed_forward), [float(it) for it in convection])
    return Flown(json.loads(_leeward.fly(plan._plan, cases, air, until_s)))

"""Recordings: found on the disk, simulated, diagnosed, calibrated."""

from __future__ import annotations

import gzip
import html
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _leeward
from ._errors import Problem, RecordingError

if TYPE_CHECKING:
    import pandas as _pandas

PathLike = Union[str, os.PathLike[str]]

_META = "meta.json"
_CAMPAIGN = "campaign.ron"
#: How many folders above a flight its campaign file is looked for.
_PARENTS = 2


def _refused(path: Path, message: str, help: str) -> RecordingError:
    problem = Problem(message=message, file=str(path), help=help)
    return RecordingError(f"{path}: {message}; {help}", (problem,))


def _read_all(paths: Union[PathLike, Sequence[PathLike]], meta: PathLike | None) -> list[Any]:
    """Every recording at some paths: folders with a meta.json, flight logs, folders of either."""
    given = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    sources: list[Path] = []
    for one in map(Path, given):
        if not one.exists():
            raise FileNotFoundError(one)
        sources.extend(_sources(one))
    return [_read(it, meta) for it in sorted(dict.fromkeys(sources), key=lambda it: it.name)]


def _stem(path: Path) -> str | None:
    """What a log is called; none where neither its name nor its first bytes are a log's."""
    with path.open("rb") as file:
        return _leeward.log_name(path.name, file.read(_leeward.LOG_HEAD_BYTES))


def _sources(path: Path) -> list[Path]:
    if path.is_file():
        if _stem(path) is None:
            raise _refused(path, "is no flight log", f"logs are {_leeward.LOG_FILES}")
        return [path]
    if (path / _META).is_file():
        return [path]
    flights = path / "flights"
    folder = flights if flights.is_dir() else path
    entries = sorted(folder.iterdir())
    found = [it for it in entries if (it / _META).is_file() or (it.is_file() and _stem(it))]
    if not found:
        help = "a recording is a folder with a meta.json, a flight log, or a folder of either"
        raise _refused(path, "holds no recording", help)
    return found


def _bytes(path: Path) -> bytes:
    return gzip.decompress(path.read_bytes()) if path.name.endswith(".gz") else path.read_bytes()


def _read(path: Path, meta: PathLike | None) -> _leeward.Recording:
    if path.is_dir():
        files = {it.name: _bytes(it) for it in path.iterdir() if it.name in _leeward.FOLDER_FILES}
        return _leeward.Recording.read_folder(path.resolve().name, files)
    above = [path.resolve().parent, *path.resolve().parent.parents][: 1 + _PARENTS]
    beside = next((it / _CAMPAIGN for it in above if (it / _CAMPAIGN).is_file()), None)
    campaign = beside if meta is None else Path(meta)
    if campaign is None:
        help = f"name one with meta=, or put a {_CAMPAIGN} beside it or up to two folders above"
        raise _refused(path, "has no campaign file", help)
    name, file = _stem(path) or path.name, str(path).removesuffix(".gz")
    text = campaign.read_text(encoding="utf-8")
    return _leeward.Recording.read_log((name, file), _bytes(path), (str(campaign), text))


@dataclass(frozen=True, eq=False)
class Simulation:
    """Recorded values beside the simulated ones, a row each."""

    recording: str
    channel: npt.NDArray[np.str_]
    """``speed`` (m/s), ``throttle``, ``power`` (over hover), ``vertical_force`` (N)."""
    row: npt.NDArray[np.uint64]
    """Data row, from 0, in the file of the channel."""
    t_s: npt.NDArray[np.float64]
    subject: npt.NDArray[np.uint32]
    """Probe id, or index of the vehicle."""
    position_m: npt.NDArray[np.float64]
    """Where it was measured (m); shape (n, 3)."""
    recorded: npt.NDArray[np.float64]
    simulated: npt.NDArray[np.float64]
    air_mps: npt.NDArray[np.float64]
    """Axial speed of the air that is simulated there (m/s)."""
    left_out: list[str] = field(default_factory=list)
    """What could not be simulated, and why."""

    @property
    def residual(self) -> npt.NDArray[np.float64]:
        """Recorded minus simulated."""
        return self.recorded - self.simulated

    def to_pandas(self) -> _pandas.DataFrame:
        """A row a value; needs pandas."""
        import pandas as pd

        names = ["channel", "row", "t_s", "subject", "recorded", "simulated", "air_mps"]
        table = pd.DataFrame({name: getattr(self, name) for name in names})
        for axis, name in enumerate("xyz"):
            table[f"{name}_m"] = self.position_m[:, axis]
        return table


def simulate(
    recordings: Union[PathLike, Sequence[PathLike]], *, meta: PathLike | None = None
) -> list[Simulation]:
    """What the declared simulation would have recorded, beside what was; one for each recording.

    ``recordings``: folders with a meta.json, flight logs (``plan diagnose --help`` lists them), or folders of
    either; ``meta``: what flight logs leave unsaid, by default the campaign.ron beside or above
    them. Raises ``RecordingError`` with every problem at its file and line.
    """
    found = []
    for one in _read_all(recordings, meta):
        table, left_out = _leeward.simulate(one)
        table["channel"] = np.asarray(table["channel"], dtype=np.str_)
        found.append(Simulation(recording=one.name, left_out=left_out, **table))
    return found


@dataclass(frozen=True)
class Diagnosis:
    """What physics a simulation left out of a recording, or that nothing known explains it."""

    recording: str
    data: dict[str, Any]
    """All of it, as diagnosis.json has it, ``remarks`` on the recordings included."""
    finding_ron: str
    """As a file that `plan --finding` and ``leeward.plan(finding=...)`` take."""

    @property
    def verdict(self) -> str:
        """In a word, as docs/diagnosis.md has them."""
        return str(self.data["verdict"])

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The effects that are missing in the simulation, with parameters and intervals."""
        effects: list[dict[str, Any]] = self.data["effects"]
        return effects

    def _repr_html_(self) -> str:
        names = "".join(f"<li>{html.escape(json.dumps(it))}</li>" for it in self.effects)
        return f"<b>{html.escape(self.recording)}</b>: {html.escape(self.verdict)}<ul>{names}</ul>"


def diagnose(
    recordings: Union[PathLike, Sequence[PathLike]],
    *,
    meta: PathLike | None = None,
    channel: str | None = None,
    alone: bool = False,
    near_floor: bool = False,
) -> list[Diagnosis]:
    """Where simulation and recording differ, what is missing, how well the correction predicts.

    Recordings of probes and receivers are diagnosed one by one (``channel``: of ``speed``,
    ``throttle``, ``power``); flight logs together, as one diagnosis, with whole flights held out
    (``alone``: begin with drones that fly alone; ``near_floor``: judge flights near the floor
    only). Raises ``RecordingError``.
    """
    read = _read_all(recordings, meta)
    logs = [it for it in read if it.is_flight_log]
    if logs and len(logs) != len(read):
        raise RecordingError("flight logs are diagnosed together, without other recordings")
    if logs:
        finding, ron = _leeward.diagnose_flights(logs, alone, near_floor)
        name = " ".join(it.name for it in logs[:3])
        return [Diagnosis(name, json.loads(finding), ron)]
    if alone or near_floor:
        raise RecordingError("alone and near_floor are of flight logs; there are none")
    found = []
    for one in read:
        finding, ron = _leeward.diagnose(one, channel)
        found.append(Diagnosis(one.name, json.loads(finding), ron))
    return found


@dataclass(frozen=True)
class Calibration:
    """The constants of the jet that fit some recordings best."""

    data: dict[str, Any]
    """All of it, as calibration.json has it, ``remarks`` on the recordings included."""
    jet_ron: str
    """As a file that scenarios cite."""

    @property
    def verdict(self) -> str:
        """Whether one jet describes the readings."""
        return str(self.data["goodness"]["verdict"])


def calibrate(
    recordings: Union[PathLike, Sequence[PathLike]], *, meta: PathLike | None = None, seed: int = 0
) -> Calibration:
    """The constants of the jet from recordings of probes below hovering drones.

    ``seed``: of the draws of signs behind the p-value of the misfit. Raises ``RecordingError``.
    """
    found, jet = _leeward.calibrate(_read_all(recordings, meta), seed)
    return Calibration(json.loads(found), jet)

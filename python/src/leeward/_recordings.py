"""Recordings: found on the disk, simulated, diagnosed, calibrated."""

from __future__ import annotations

import filecmp
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


@dataclass(frozen=True)
class _Read:
    """Recordings in the order of their names."""

    recordings: list[_leeward.Recording]
    left_out: list[dict[str, Any]]
    """A remark on each that is not used."""


def _read_all(paths: Union[PathLike, Sequence[PathLike]], meta: PathLike | None) -> _Read:
    """Every recording at some paths: folders with a meta.json, flight logs, folders of either.

    One that is named must be in order; of those that only their folder names, one that is not is
    left out.
    """
    given = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    named = [Path(it) for it in given]
    sources: list[Path] = []
    for one in named:
        if not one.exists():
            raise FileNotFoundError(one)
        sources.extend(_sources(one))
    sources = sorted(dict.fromkeys(sources), key=lambda it: it.name)
    sources, copies = _without_copies(sources)
    files = [_campaign_of(it, meta) for it in sources]
    parsed = {
        file: _leeward.Campaign(str(file), file.read_text(encoding="utf-8"))
        for file in dict.fromkeys(files)
        if file is not None
    }
    recordings: list[_leeward.Recording] = []
    refused: list[RecordingError] = []
    bad: list[tuple[Path, RecordingError]] = []
    for source, file in zip(sources, files):
        try:
            recordings.append(_read(source, None if file is None else parsed[file]))
        except RecordingError as why:
            refused.append(why) if source in named else bad.append((source, why))
    if refused or not recordings:
        refused.extend(it for _, it in bad)
        problems = tuple(problem for it in refused for problem in it.problems)
        message = "\n".join(map(str, refused)) or "no recording is named"
        raise RecordingError(message, problems)
    left_out = []
    for source, spoilt in bad:
        first, help = str(spoilt).split("\n")[0], spoilt.problems[0].help
        message = f"{source} is left out: {first}" + (f" ({help})" if help else "")
        left_out.append(_unused(source, message))
    for copy, of in copies:
        left_out.append(_unused(copy, f"{copy} is a copy of {of}: one flight"))
    return _Read(recordings, left_out)


def _unused(source: Path, message: str) -> dict[str, Any]:
    remark: dict[str, Any] = json.loads(_leeward.unused(_name(source), message))
    return remark


def _without_copies(sources: list[Path]) -> tuple[list[Path], list[tuple[Path, Path]]]:
    """Without logs that hold the same bytes as one before, and these, each with that one."""
    kept: list[Path] = []
    copies: list[tuple[Path, Path]] = []
    by_size: dict[int, list[Path]] = {}
    for source in sources:
        if source.is_file():
            alike = by_size.setdefault(source.stat().st_size, [])
            same = (it for it in alike if filecmp.cmp(it, source, shallow=False))
            if (of := next(same, None)) is not None:
                copies.append((source, of))
                continue
            alike.append(source)
        kept.append(source)
    return kept, copies


def _stem(path: Path) -> str | None:
    """What a log is called; none where neither its name nor its first bytes are a log's."""
    with path.open("rb") as file:
        return _leeward.log_name(path.name, file.read(_leeward.LOG_HEAD_BYTES))


def _name(source: Path) -> str:
    """What a recording is called."""
    return source.resolve().name if source.is_dir() else _stem(source) or source.name


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
    # A folder of tables without its meta.json is told when it is read.
    found = [it for it in entries if _holds_tables(it) or (it.is_file() and _stem(it))]
    if not found:
        help = "a recording is a folder with a meta.json, a flight log, or a folder of either"
        raise _refused(path, "holds no recording", help)
    return found


def _holds_tables(folder: Path) -> bool:
    return any((folder / it).is_file() for it in _leeward.FOLDER_FILES)


def _bytes(path: Path) -> bytes:
    return gzip.decompress(path.read_bytes()) if path.name.endswith(".gz") else path.read_bytes()


def _campaign_of(source: Path, meta: PathLike | None) -> Path | None:
    """Its campaign file; none where it needs none."""
    if source.is_dir():
        return None
    if meta is not None:
        return Path(meta)
    above = list(source.resolve().parents)[: 1 + _PARENTS]
    beside = next((it / _CAMPAIGN for it in above if (it / _CAMPAIGN).is_file()), None)
    if beside is None:
        help = f"name one with meta=, or put a {_CAMPAIGN} beside it or up to two folders above"
        raise _refused(source, "has no campaign file", help)
    return beside


def _read(source: Path, campaign: _leeward.Campaign | None) -> _leeward.Recording:
    name = _name(source)
    if campaign is None:
        files = {it.name: _bytes(it) for it in source.iterdir() if it.name in _leeward.FOLDER_FILES}
        return _leeward.Recording.read_folder(name, str(source), files)
    file = str(source).removesuffix(".gz")
    return _leeward.Recording.read_log(name, file, _bytes(source), campaign)


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
    remarks: list[dict[str, Any]] = field(default_factory=list)
    """All that was noticed, as residuals.json has it; what is not used of the folders that were
    named stands with the first."""

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

    ``recordings``: folders with a meta.json, flight logs (``plan diagnose --help`` lists them), or
    folders of either; ``meta``: what flight logs leave unsaid, by default the campaign.ron beside
    or above them. Thrust maps are identified in all flight logs together. Of what only its folder
    names, a recording that cannot be read is left out, with a remark. Raises ``RecordingError``
    with every problem at its file and line, and where nothing can be compared.
    """
    read = _read_all(recordings, meta)
    found = []
    for one, (table, left_out, remarks) in zip(read.recordings, _leeward.simulate(read.recordings)):
        table["channel"] = np.asarray(table["channel"], dtype=np.str_)
        told = json.loads(remarks)
        found.append(Simulation(recording=one.name, left_out=left_out, remarks=told, **table))
    if not any(it.row.size for it in found):
        why = "; ".join(why for it in found for why in it.left_out)
        raise RecordingError(f"nothing to compare in {len(found)} recordings; {why}")
    found[0].remarks[:0] = read.left_out
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
    them, found = read.recordings, []
    if any(it.is_of_a_force for it in them):
        others = ", ".join(it.name for it in them if not it.is_flight_log)
        if others:
            raise RecordingError(
                f"no flight logs: {others}; diagnose these by themselves: logs are judged together"
            )
        if channel is not None:
            raise RecordingError(
                f"channel {channel} chooses among readings of probes and receivers; logs are "
                "judged by the forces on their drones"
            )
        finding, ron = _leeward.diagnose_flights(them, alone, near_floor)
        name = " ".join([it.name for it in them if it.is_of_a_force][:3])
        found.append(Diagnosis(name, json.loads(finding), ron))
    elif all(it.is_flight_log for it in them):
        raise RecordingError(_leeward.no_force(them))
    elif alone or near_floor:
        raise RecordingError("alone and near_floor are of flight logs; there are none")
    else:
        for one in them:
            finding, ron = _leeward.diagnose(one, channel)
            found.append(Diagnosis(one.name, json.loads(finding), ron))
    found[0].data["remarks"][:0] = read.left_out
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
    read = _read_all(recordings, meta)
    found, jet = _leeward.calibrate(read.recordings, seed)
    data = json.loads(found)
    data["remarks"][:0] = read.left_out
    return Calibration(data, jet)

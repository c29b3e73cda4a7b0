"""Recordings: found on the disk, simulated, diagnosed, calibrated."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _leeward
from ._errors import RecordingError

if TYPE_CHECKING:
    import pandas as _pandas

PathLike = Union[str, os.PathLike[str]]


def _read_all(
    paths: Union[PathLike, Sequence[PathLike]], meta: PathLike | None
) -> tuple[list[_leeward.Recording], list[dict[str, Any]]]:
    """Every recording at some paths in the order of their names, and a remark on each that is not
    used."""
    given = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    if not given:
        raise RecordingError("no recording is named")
    named = [os.fspath(it) for it in given]
    read, left_out = _leeward.read_all(named, None if meta is None else os.fspath(meta))
    return read, json.loads(left_out)


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
    them, unused = _read_all(recordings, meta)
    found = []
    for one, (table, left_out, remarks) in zip(them, _leeward.simulate(them)):
        table["channel"] = np.asarray(table["channel"], dtype=np.str_)
        told = json.loads(remarks)
        found.append(Simulation(recording=one.name, left_out=left_out, remarks=told, **table))
    if not any(it.row.size for it in found):
        why = "; ".join(why for it in found for why in it.left_out)
        raise RecordingError(f"nothing to compare in {len(found)} recordings; {why}")
    found[0].remarks[:0] = unused
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
    them, unused = _read_all(recordings, meta)
    found = []
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
    found[0].data["remarks"][:0] = unused
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
    them, unused = _read_all(recordings, meta)
    found, jet = _leeward.calibrate(them, seed)
    data = json.loads(found)
    data["remarks"][:0] = unused
    return Calibration(data, jet)

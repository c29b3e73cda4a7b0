from typing import Any, TypeAlias, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "PRESETS",
    "Air",
    "Plan",
    "Recording",
    "Running",
    "Separation",
    "World",
    "__version__",
    "calibrate",
    "check",
    "diagnose",
    "diagnose_flights",
    "export",
    "fly",
    "no_force",
    "plan",
    "read_all",
    "simulate",
    "written_by_another",
]

_Floats: TypeAlias = npt.NDArray[np.float64]
_Numbers: TypeAlias = tuple[float, int, float, float, float]
_To: TypeAlias = tuple[list[float], float, float | None]
_Change: TypeAlias = tuple[str, str, float, list[_To]]

__version__: str
PRESETS: list[str]

@final
class Air:
    def __new__(
        cls,
        name: str,
        numbers: _Numbers | None,
        mass_kg: float | None,
        outside: tuple[float, float],
    ) -> Air: ...
    @property
    def hover_velocity_mps(self) -> float: ...
    @property
    def density_kg_per_m3(self) -> float: ...
    @property
    def motor_distance_m(self) -> float: ...
    @property
    def near_field_depth_m(self) -> float: ...
    def speed(self, offsets_m: _Floats) -> _Floats: ...
    def velocity(self, offsets_m: _Floats) -> _Floats: ...
    def mean_over_discs(self, receiver: Air, offsets_m: _Floats) -> _Floats: ...

@final
class Separation:
    def __new__(cls, lower: Air, upper: Air) -> Separation: ...
    def met(self, below_m: _Floats, beside_m: _Floats) -> list[_Floats]: ...
    def below_m(self, alpha: float, beside_m: float) -> float: ...

@final
class World:
    def __new__(cls, named: tuple[str, str], folder: str, finding: str | None) -> World: ...
    @property
    def name(self) -> str: ...
    @property
    def drones(self) -> list[str]: ...

@final
class Plan:
    @staticmethod
    def read(path: str, text: str) -> Plan: ...
    @staticmethod
    def restored(text: str, notes: list[str], untold: int) -> Plan: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def untold(self) -> int: ...
    def json(self) -> str: ...
    def page(self, world: World | None) -> str: ...
    def positions(self, drone: int, t_s: _Floats) -> _Floats: ...

@final
class Recording:
    @property
    def name(self) -> str: ...
    @property
    def is_flight_log(self) -> bool: ...
    @property
    def is_of_a_force(self) -> bool: ...

@final
class Running:
    def __new__(cls, world: World, plan: Plan) -> Running: ...
    def plan(self) -> Plan: ...
    def replan(self, at_s: float, changes: list[_Change]) -> str: ...

def plan(
    world: World, seed: int | None, time_limit_s: float | None, contrast: bool
) -> Plan: ...
def check(path: str | None, text: str, late: bool) -> str: ...
def fly(
    plan: Plan,
    cases: tuple[list[str], list[str], list[float]],
    air: tuple[float | None, bool, int],
    until_s: float | None,
) -> str: ...
def export(
    text: str,
    to: tuple[str, str],
    georeference: tuple[float, float, float, float] | None,
    setpoints: tuple[str | None, float | None, bool],
    only: tuple[bool, bool],
) -> tuple[str, list[tuple[str, bytes]]]: ...
def written_by_another(folder: str) -> tuple[str, str] | None: ...
def read_all(paths: list[str], meta: str | None) -> tuple[list[Recording], str]: ...
def no_force(recordings: list[Recording]) -> str: ...
def simulate(
    recordings: list[Recording],
) -> list[tuple[dict[str, Any], list[str], str]]: ...
def diagnose(recording: Recording, channel: str | None) -> tuple[str, str]: ...
def diagnose_flights(
    recordings: list[Recording], alone: bool, near_the_floor: bool
) -> tuple[str, str]: ...
def calibrate(recordings: list[Recording], seed: int) -> tuple[str, str]: ...

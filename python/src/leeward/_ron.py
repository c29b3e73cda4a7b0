"""Scenarios from a path, a text, or a dict with the same keys."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Union

from ._errors import Problem, ScenarioError

Scenario = Union[str, "os.PathLike[str]", Mapping[str, Any]]


class Name(str):
    """A name without quotes in a scenario that is a dict: ``{"at_end": Name("Land")}``."""


#: Keys whose values are such names.
_NAMED = {"at_start", "at_end", "motion", "superposition", "convection"}
#: Keys for which ``None`` is a value of its own; of others it is left out.
_OR_NONE = {"convection"}
#: Keys whose entries are named by who writes the scenario: a map of RON.
_MAPS = {"airframes"}


def text_of(scenario: Scenario) -> tuple[str, str, str]:
    """What to call it, its text, and the folder of the files that it cites."""
    if isinstance(scenario, Mapping):
        return "scenario", f"Scenario{_fields(scenario, 1, '')}", "."
    if isinstance(scenario, str) and "(" in scenario and not os.path.isfile(scenario):
        return "scenario", scenario, "."
    path = Path(scenario)
    return str(path), path.read_text(encoding="utf-8"), str(path.parent)


def _fields(entries: Mapping[str, Any], depth: int, place: str, is_map: bool = False) -> str:
    pad = "    " * depth
    lines = [
        f"{pad}{_text(key) if is_map else key}: "
        f"{_value(value, key, depth, f'{place}.{key}' if place else f'{key}')},\n"
        for key, value in entries.items()
        if value is not None or key in _OR_NONE
    ]
    begins, ends = "{}" if is_map else "()"
    return f"{begins}\n" + "".join(lines) + "    " * (depth - 1) + ends


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _value(value: Any, key: str, depth: int, place: str) -> str:
    """As RON; ``place``: where it stands in the dict, ``drones[0].start_m[2]``."""
    value = _plain(value)
    if isinstance(value, Name) or (isinstance(value, str) and key in _NAMED):
        return str(value)
    if isinstance(value, Mapping):
        return _fields(value, depth + 1, place, key in _MAPS)
    if value is None and key in _OR_NONE:
        return "None"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            problem = Problem(f"`{place}`: {value} is not finite", file="scenario")
            raise ScenarioError(problem.message, (problem,))
        return repr(value)
    if isinstance(value, (list, tuple)):
        each = enumerate(value)
        inside = ", ".join(_value(it, "", depth + 1, f"{place}[{k}]") for k, it in each)
        numbers = all(isinstance(_plain(it), (int, float)) for it in value)
        is_tuple = isinstance(value, tuple) or (numbers and len(value) in (2, 3))
        return f"({inside})" if is_tuple else f"[{inside}]"
    raise TypeError(f"{place} is a {type(value).__name__}, nothing that a scenario has")


def _plain(value: Any) -> Any:
    """NumPy's arrays and numbers as Python's own."""
    return value.tolist() if hasattr(value, "tolist") else value

"""The air below one hovering drone, and how far below it another may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _leeward
from ._arrays import Floats, floats

if TYPE_CHECKING:
    import pandas as _pandas

#: Airframes that are known by name.
PRESETS: tuple[str, ...] = tuple(_leeward.PRESETS)


@dataclass(frozen=True)
class Airframe:
    """A multirotor by its numbers."""

    name: str
    mass_kg: float
    propellers: int
    propeller_diameter_m: float
    motor_distance_m: float
    """The diagonal from motor to motor."""
    width_factor: float = 1.0
    """How much wider its wake is than that of propellers that are not canted."""


class Air:
    """The mean airflow below a hovering drone.

    ``airframe``: one of ``PRESETS``, or an ``Airframe``; ``mass_kg``: with payload, the airframe's
    own if it is left out; ``temperature_c`` (°C) and ``pressure_pa`` (Pa) of the still air.

    Raises ``ValueError`` for an airframe that is not known, or a number that cannot be.
    """

    def __init__(
        self,
        airframe: Union[str, Airframe],
        mass_kg: float | None = None,
        *,
        temperature_c: float = 20.0,
        pressure_pa: float = 101_325.0,
    ) -> None:
        outside = (float(temperature_c), float(pressure_pa))
        self._given = (airframe, mass_kg, *outside)
        if isinstance(airframe, Airframe):
            numbers = (
                float(airframe.mass_kg),
                _count(airframe.propellers),
                float(airframe.propeller_diameter_m),
                float(airframe.motor_distance_m),
                float(airframe.width_factor),
            )
            self.name = airframe.name
            self._air = _leeward.Air(airframe.name, numbers, mass_kg, outside)
        else:
            self.name = airframe
            self._air = _leeward.Air(airframe, None, mass_kg, outside)

    @property
    def hover_velocity_mps(self) -> float:
        """Induced velocity at hover (m/s)."""
        return self._air.hover_velocity_mps

    @property
    def density_kg_per_m3(self) -> float:
        """Of the air (kg/m³)."""
        return self._air.density_kg_per_m3

    @property
    def motor_distance_m(self) -> float:
        """The diagonal from motor to motor (m)."""
        return self._air.motor_distance_m

    @property
    def near_field_depth_m(self) -> float:
        """Down to here the jets of single rotors merge (m)."""
        return self._air.near_field_depth_m

    def speed(self, xyz: npt.ArrayLike) -> Floats:
        """Axial speed, downwards (m/s), at offsets from the centre of the rotor plane.

        ``xyz``: shape (n, 3) or (3,), m, z up; below the drone z is negative. Shape (n,).
        """
        return self._air.speed(_rows(xyz))

    def velocity(self, xyz: npt.ArrayLike) -> Floats:
        """Velocity of the air (m/s, world axes) at such offsets; shape (n, 3)."""
        return self._air.velocity(_rows(xyz))

    def mean_over_discs(self, receiver: Air, xyz: npt.ArrayLike) -> Floats:
        """Mean axial speed (m/s) over the rotor discs of a level drone at such offsets; (n,)."""
        if not isinstance(receiver, Air):
            kind = type(receiver).__name__
            raise TypeError(f"receiver is a {kind}; an Air is wanted: Air({receiver!r})")
        return self._air.mean_over_discs(receiver._air, _rows(xyz))

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes."""
        return _air, self._given

    def __repr__(self) -> str:
        return f"Air({self.name!r}, hover_velocity_mps={self.hover_velocity_mps:.2f})"


def _air(
    airframe: Union[str, Airframe],
    mass_kg: float | None,
    temperature_c: float,
    pressure_pa: float,
) -> Air:
    return Air(airframe, mass_kg, temperature_c=temperature_c, pressure_pa=pressure_pa)


def _count(propellers: Any) -> int:
    """As many as the extension takes; which of them can be, that says."""
    if not (0 <= propellers < 2**32 and propellers == int(propellers)):
        raise ValueError(f"propellers is {propellers}; a whole number is wanted, from 1")
    return int(propellers)


def _rows(xyz: npt.ArrayLike) -> Floats:
    rows = np.ascontiguousarray(floats("xyz", xyz))
    if rows.ndim not in (1, 2):
        raise ValueError(f"xyz: shape {rows.shape}; (n, 3) or (3,) is wanted")
    return rows[None, :] if rows.ndim == 1 else rows


@dataclass(frozen=True, eq=False)
class Separation:
    """What one hovering drone makes of the air of another, by how far it is below and beside."""

    above: str
    """Whose wake it is."""
    below: str
    """Who is in it."""
    depth_m: Floats
    """How far below, rotor plane to rotor plane (m); shape (d,)."""
    offset_m: Floats
    """How far beside (m); shape (o,)."""
    air_mps: Floats
    """Mean air over the lower drone's discs (m/s), whichever way it is beside; shape (d, o)."""
    alpha: Floats
    """The same over its own induced velocity; shape (d, o)."""
    power: Floats
    """Its power to hover there over that in still air; shape (d, o)."""

    _airs: tuple[Air, Air] = field(repr=False)

    def depth_needed_m(self, alpha: float, offset_m: float = 0.0) -> float:
        """From which depth on (m) ``alpha`` (above 0) is not exceeded, so far beside (m, from 0);
        0 if it is exceeded at none."""
        if not (np.isfinite(alpha) and alpha > 0.0):
            raise ValueError(f"alpha is {alpha}; it must be finite and above 0")
        if not (np.isfinite(offset_m) and offset_m >= 0.0):
            raise ValueError(f"offset_m is {offset_m}; it must be finite and not below 0")
        lower, upper = self._airs
        return _leeward.Separation(lower._air, upper._air).below_m(alpha, offset_m)

    def to_pandas(self) -> _pandas.DataFrame:
        """A row for each depth and offset; needs pandas."""
        import pandas as pd

        depth, offset = np.meshgrid(self.depth_m, self.offset_m, indexing="ij")
        columns = {
            "depth_m": depth,
            "offset_m": offset,
            "air_mps": self.air_mps,
            "alpha": self.alpha,
            "power": self.power,
        }
        return pd.DataFrame({name: values.ravel() for name, values in columns.items()})

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{it:.2f} m</th>" for it in self.offset_m)
        rows = "".join(
            f"<tr><th>{depth:.2f} m</th>" + "".join(f"<td>{it:.3f}</td>" for it in row) + "</tr>"
            for depth, row in zip(self.depth_m, self.alpha)
        )
        title = f"alpha of {_escaped(self.below)} below {_escaped(self.above)}, by offset"
        return f"<table><caption>{title}</caption><tr><th></th>{head}</tr>{rows}</table>"


def _escaped(text: str) -> str:
    import html

    return html.escape(text)


def separation(
    airframe: Union[str, Airframe, Air],
    *,
    under: Union[str, Airframe, Air],
    depths_m: Sequence[float] | Floats | None = None,
    offsets_m: Sequence[float] | Floats | None = None,
    temperature_c: float = 20.0,
    pressure_pa: float = 101_325.0,
) -> Separation:
    """How much air a drone meets below another, both hovering in still air.

    ``airframe``: the lower; ``under``: the upper. ``Air`` objects carry their own payload and
    weather. ``depths_m`` (m, above 0) and ``offsets_m`` (m, from 0): by default from the lower's
    motor distance to 60 of the upper's, and up to 3 of them beside.
    """

    def air_of(of: Union[str, Airframe, Air]) -> Air:
        if isinstance(of, Air):
            return of
        return Air(of, temperature_c=temperature_c, pressure_pa=pressure_pa)

    lower, upper = air_of(airframe), air_of(under)
    unit_m = upper.motor_distance_m
    depths = _line(depths_m, np.geomspace(lower.motor_distance_m, 60.0 * unit_m, 40), "depths_m")
    offsets = _line(offsets_m, np.linspace(0.0, 3.0 * unit_m, 7), "offsets_m")
    if not (depths > 0.0).all():
        raise ValueError("depths_m: every depth must be above 0 m")
    if not (offsets >= 0.0).all():
        raise ValueError("offsets_m: no offset may be below 0 m")
    pair = _leeward.Separation(lower._air, upper._air)
    air, alpha, power = pair.met(depths, offsets)
    return Separation(
        above=upper.name,
        below=lower.name,
        depth_m=depths,
        offset_m=offsets,
        air_mps=air,
        alpha=alpha,
        power=power,
        _airs=(lower, upper),
    )


def _line(given: Any, usual: Floats, name: str) -> Floats:
    line = usual if given is None else np.atleast_1d(floats(name, given))
    if line.ndim != 1 or line.size == 0 or not np.isfinite(line).all():
        raise ValueError(f"{name}: a line of finite lengths (m) is asked for")
    return np.sort(line)



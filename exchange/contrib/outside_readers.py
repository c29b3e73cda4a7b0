"""Exports of `plan export`, read by the formats' own readers.

usage: outside_readers.py PLAN_COMMAND SCENARIO.ron FOLDER

Plans a scenario, exports it, and compares what `mcap`, `pymavlink`, MAVSDK and `pyproj` read with
the positions in plan.json. Prints a line for each format; ends with 1 where one is off. Needs
mcap, jsonschema, mavsdk, pymavlink and pyproj, as `.ci/run` installs them.
"""

import bisect
import json
import math
import subprocess
import sys
from pathlib import Path

import jsonschema
import pyproj
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins.mission_raw.mission_raw import MissionRaw
from mcap.reader import make_reader
from pymavlink import mavwp
from pymavlink.dialects.v20 import common

# Latitude, longitude (deg), height (m), heading of +x (deg, clockwise from north).
ORIGIN = (47.4, 8.55, 488.0, 30.0)
GEOREFERENCE = ",".join(f"{it:g}" for it in ORIGIN)


def position_m(drone, t_s):
    """Where a drone of plan.json is: Bernstein form, straight where there are no inner points."""
    path = drone["trajectory"]
    times, places = path["t_s"], path["position_m"]
    k = min(max(bisect.bisect_right(times, t_s) - 1, 0), len(times) - 1)
    if k == len(times) - 1 or t_s <= times[0]:
        return places[k if t_s > times[0] else 0]
    u = (t_s - times[k]) / (times[k + 1] - times[k])
    inner = path.get("control_m", [[]] * len(times))[k]
    row = [places[k], *inner, places[k + 1]]
    while len(row) > 1:
        row = [[a + (b - a) * u for a, b in zip(p, q)] for p, q in zip(row, row[1:])]
    return row[0]


def distance_m(a, b):
    return math.dist(a, b)


class Earth:
    """Places of the world on the ellipsoid, by way of geocentric coordinates."""

    def __init__(self):
        latitude, longitude, height, heading = ORIGIN
        self.to_geocentric = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
        self.centre = self.to_geocentric.transform(longitude, latitude, height)
        self.north, self.east = math.radians(latitude), math.radians(longitude)
        self.heading = math.radians(heading)

    def world_m(self, latitude, longitude, height):
        there = self.to_geocentric.transform(longitude, latitude, height)
        x, y, z = (a - b for a, b in zip(there, self.centre))
        sin_n, cos_n = math.sin(self.north), math.cos(self.north)
        sin_e, cos_e = math.sin(self.east), math.cos(self.east)
        east = -sin_e * x + cos_e * y
        north = -sin_n * cos_e * x - sin_n * sin_e * y + cos_n * z
        up = cos_n * cos_e * x + cos_n * sin_e * y + sin_n * z
        sin_h, cos_h = math.sin(self.heading), math.cos(self.heading)
        return [east * sin_h + north * cos_h, north * sin_h - east * cos_h, up]


def read_mcap(path, drones):
    """Centres of the drones' bodies at every message, and the first message against its schema."""
    off_m, messages, samples = 0.0, 0, 0
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic != "/leeward/scene":
                continue
            scene = json.loads(message.data)
            if messages == 0:
                jsonschema.validate(scene, json.loads(schema.data))
            messages += 1
            for entity in scene["entities"]:
                names = [it["value"] for it in entity["metadata"] if it["key"] == "name"]
                if not names:
                    continue
                drone = drones[names[0]]
                at = entity["spheres"][0]["pose"]["position"]
                planned = position_m(drone, message.log_time * 1e-9)
                off_m = max(off_m, distance_m([at["x"], at["y"], at["z"]], planned))
                samples += 1
    assert messages > 10, f"{messages} messages"
    return off_m, samples


def read_czml(path, drones, earth):
    off_m, samples = 0.0, 0
    for packet in json.loads(Path(path).read_text())[1:]:
        numbers = packet["position"]["cartographicDegrees"]
        for t_s, longitude, latitude, height in zip(*[iter(numbers)] * 4):
            planned = position_m(drones[packet["name"]], t_s)
            off_m = max(off_m, distance_m(earth.world_m(latitude, longitude, height), planned))
            samples += 1
    return off_m, samples


def near_path_m(place, drone):
    """How far a place is from a path, straight between moments 20 ms from one another."""
    times = drone["trajectory"]["t_s"]
    steps = max(int(times[-1] / 0.02), 1)
    moments = sorted([times[-1] * k / steps for k in range(steps + 1)] + times)
    path = [position_m(drone, t_s) for t_s in moments]
    return min(to_segment_m(place, a, b) for a, b in zip(path, path[1:] or path))


def to_segment_m(place, a, b):
    along, to_place = [[q - p for p, q in zip(a, end)] for end in (b, place)]
    length2 = sum(it * it for it in along)
    part = sum(p * q for p, q in zip(along, to_place)) / length2 if length2 > 0 else 0.0
    part = min(max(part, 0.0), 1.0)
    return distance_m(place, [p + part * it for p, it in zip(a, along)])


def read_waypoints(folder, drones, earth):
    """Waypoints have no times: each must lie on its drone's path, in order of MAVLink's reader."""
    off_m, items = 0.0, 0
    for name, drone in drones.items():
        loader = mavwp.MAVWPLoader()
        loader.load(str(folder / f"{name}.waypoints"))
        home = loader.wp(0)
        plan = json.loads((folder / f"{name}.plan").read_text())["mission"]
        assert len(plan["items"]) == loader.count() - 1, f"{name}: {len(plan['items'])} items"
        for k in range(1, loader.count()):
            item = loader.wp(k)
            assert item.frame == 3 and item.command in (16, 21, 22), f"{name}: item {k}"
            assert item.command == 16 or item.param1 == 0.0, f"{name}: item {k} holds"
            place = earth.world_m(item.x, item.y, home.z + item.z)
            other = plan["items"][k - 1]
            assert other["command"] == item.command and abs(other["params"][0] - item.param1) < 1e-3
            off_m = max(off_m, distance_m(place, earth.world_m(*other["params"][4:6], home.z + other["params"][6])))
            off_m = max(off_m, near_path_m(place, drone))
            items += 1
        assert loader.wp(1).command == 22, f"{name} does not take off first"
    return off_m, items


def mission_reader():
    """MAVSDK's reader of QGroundControl's plans, which asks for a vehicle: a heartbeat is one."""
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    station.add_any_connection("raw://")
    beat = common.MAVLink_heartbeat_message(common.MAV_TYPE_QUADROTOR, common.MAV_AUTOPILOT_PX4, 0, 0, 0, 3)
    station.pass_received_raw_bytes(bytes(beat.pack(common.MAVLink(None, srcSystem=1, srcComponent=1))))
    vehicle = station.first_autopilot(10.0)
    assert vehicle is not None, "MAVSDK knows no vehicle"
    # The station lives as long as its reader.
    return station, MissionRaw(vehicle)


def read_missions(folder, drones, earth):
    """Missions as MAVSDK would upload them: whole 1e-7 degrees, 11 mm, heights in f32."""
    off_m, items = 0.0, 0
    _station, reader = mission_reader()
    for name, drone in drones.items():
        path = folder / f"{name}.plan"
        home_m = json.loads(path.read_text())["mission"]["plannedHomePosition"][2]
        found = reader.import_qgroundcontrol_mission(str(path)).mission_items
        assert [it.seq for it in found] == list(range(len(found))), name
        assert found[0].command == 22, f"{name} does not take off first"
        for item in found:
            assert item.frame == 3 and item.command in (16, 21, 22), f"{name}: item {item.seq}"
            place = earth.world_m(item.x * 1e-7, item.y * 1e-7, home_m + item.z)
            off_m = max(off_m, near_path_m(place, drone))
            items += 1
    return off_m, items


def main(command, scenario, out):
    out = Path(out)
    run = lambda *line: subprocess.run([command, *map(str, line)], check=True, stdout=subprocess.DEVNULL)
    run(scenario, "--no-contrast", "--no-page", "--out", out / "plan")
    plan_json = out / "plan" / "plan.json"
    drones = {it["name"]: it for it in json.loads(plan_json.read_text())["drones"]}
    located = ("--georeference", GEOREFERENCE)
    for to, more in [("mcap", ()), ("czml", located), ("qgc", (*located, "--untimed-ok"))]:
        run("export", plan_json, "--to", to, *more, "--out", out / to)
    earth = Earth()
    # The last digits of the files.
    found = [
        ("mcap", *read_mcap(out / "mcap" / "scene.mcap", drones), 1e-3),
        ("czml", *read_czml(out / "czml" / "plan.czml", drones, earth), 1e-3),
        ("qgc .waypoints", *read_waypoints(out / "qgc", drones, earth), 0.01),
        ("qgc .plan", *read_missions(out / "qgc", drones, earth), 0.01),
    ]
    for name, off_m, samples, most_m in found:
        print(f"{name}: largest deviation {1e3 * off_m:.2f} mm over {samples} samples")
    return int(any(off_m > most_m for _, off_m, _, most_m in found))


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))

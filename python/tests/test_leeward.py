"""The package as a user has it: what it answers, what it refuses, and how."""

import copy
import doctest
import hashlib
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import leeward

ROOT = Path(__file__).resolve().parents[2]
WAREHOUSE = ROOT / "scenarios" / "warehouse.ron"

TWO = """Scenario(
    name: "two",
    bounds_m: (min: (0, 0, 0), max: (12, 8, 6)),
    drones: [
        (name: "lifter", airframe: "matrice-300", start_m: (2, 4, 5), tasks: [(to_m: (10, 4, 5))]),
        (name: "scout", airframe: "kolibri", start_m: (10, 4, 1), at_end: Leave,
            tasks: [(to_m: (2, 4, 1), dwell_s: 2.5)]),
    ],
)"""
AS_DICT = {
    "name": "two",
    "bounds_m": {"min": [0, 0, 0], "max": (12, 8, 6)},
    "drones": [
        {
            "name": "lifter",
            "airframe": "matrice-300",
            "start_m": np.array([2.0, 4.0, 5.0]),
            "tasks": [{"to_m": [10, 4, 5]}],
        },
        {
            "name": "scout",
            "airframe": "kolibri",
            "start_m": (10, 4, 1),
            "at_end": "Leave",
            "tasks": [{"to_m": (2, 4, 1), "dwell_s": 2.5}],
        },
    ],
}


@pytest.fixture(scope="module")
def warehouse():
    return leeward.plan(WAREHOUSE)


@pytest.fixture(scope="module")
def two():
    return leeward.plan(TWO)


def test_the_air_is_the_jet_of_the_paper():
    mass_kg, diameter_m, l_m = 0.230, 0.0737, 0.118
    density = 101_325.0 * 0.028966 / (8.3144 * 293.15)
    disc_m2 = 4 * np.pi * (diameter_m / 2) ** 2
    u_h = np.sqrt(mass_kg * 9.81 / (2 * density * disc_m2))
    air = leeward.Air("kolibri")
    assert air.hover_velocity_mps == pytest.approx(u_h, rel=1e-12)
    s, r = np.meshgrid(np.linspace(3.0, 40.0, 30) * l_m, np.linspace(0.0, 0.8, 20), indexing="ij")
    centre = u_h * 10.11 / (s / l_m + 5.817)
    half = l_m * 0.07668 * (s / l_m + 5.817)
    expected = centre / (1 + (np.sqrt(2) - 1) * (r / half) ** 2) ** 2
    places = np.stack([r.ravel(), 0 * r.ravel(), -s.ravel()], axis=1)
    assert air.speed(places) == pytest.approx(expected.ravel(), rel=1e-3)
    assert air.velocity(places)[:, 2] == pytest.approx(-air.speed(places), rel=1e-12)
    assert (air.speed([[0.0, 0.0, 0.1], [0.0, 0.0, 0.0]]) == 0.0).all()


def test_arrays_of_any_kind_are_taken_and_wrong_ones_are_told():
    air = leeward.Air("crazyflie-2.1", mass_kg=0.034)
    single = air.speed((0.0, 0.0, -0.5))
    assert single.shape == (1,)
    assert air.speed(np.array([[0, 0, -0.5]], dtype=np.float32)) == pytest.approx(single)
    assert air.speed(np.asfortranarray(np.tile([0.0, 0.0, -0.5], (4, 1)))) == pytest.approx(
        np.repeat(single, 4)
    )
    for wrong, told in [([[1.0, 2.0]], "shape"), ([[0.0, np.nan, -1.0]], "finite")]:
        with pytest.raises(ValueError, match=told):
            air.speed(wrong)
    with pytest.raises(ValueError, match="kolibri"):
        leeward.Air("kolbri")
    with pytest.raises(ValueError, match="mass_kg"):
        leeward.Air("kolibri", mass_kg=-1.0)
    with pytest.raises(ValueError, match="temperature"):
        leeward.Air("kolibri", temperature_c=-300.0)
    kolibri = leeward.Airframe("kolibri", 0.230, 4, 0.0737, 0.118)
    assert leeward.Air(kolibri).speed((0, 0, -1)) == leeward.Air("kolibri").speed((0, 0, -1))


def test_separation_is_the_air_over_the_discs():
    found = leeward.separation("kolibri", under="matrice-300", offsets_m=[0.0, 1.0, 3.0])
    assert found.alpha.shape == (found.depth_m.size, 3)
    assert (found.alpha[:, 0] >= found.alpha[:, 2]).all()
    # P'/P from the induced velocity in downwash, by Newton's iteration.
    alpha, v = found.alpha, np.ones_like(found.alpha)
    for _ in range(50):
        v = v - (v * (v - alpha) - 1.0) / (2 * v - alpha)
    assert found.power == pytest.approx(v, rel=1e-9)
    needed = found.depth_needed_m(0.3)
    there = leeward.separation("kolibri", under="matrice-300", depths_m=[needed], offsets_m=[0.0])
    assert there.alpha[0, 0] == pytest.approx(0.3, rel=1e-4)
    # Beside, the worst of the azimuths counts: the air of one of them is no more.
    upper, lower = leeward.Air("matrice-300"), leeward.Air("kolibri")
    places = np.stack([np.ones_like(found.depth_m), 0.0 * found.depth_m, -found.depth_m], axis=1)
    assert (found.air_mps[:, 1] >= upper.mean_over_discs(lower, places) - 1e-12).all()
    # Farther beside less depth is needed, and none for a limit that nothing exceeds.
    assert found.depth_needed_m(0.3, 1.0) < needed
    assert found.depth_needed_m(9.0, 3.0) == 0.0
    for alpha, offset_m in [(0.0, 0.0), (np.nan, 0.0), (0.3, -1.0), (0.3, np.inf)]:
        with pytest.raises(ValueError, match="alpha|offset_m"):
            found.depth_needed_m(alpha, offset_m)
    assert "matrice-300" in found._repr_html_()
    with pytest.raises(ValueError, match="depths_m"):
        leeward.separation("kolibri", under="kolibri", depths_m=[-1.0])


def test_what_holds_arrays_is_compared_as_one_thing():
    one, two = (leeward.separation("kolibri", under="kolibri") for _ in range(2))
    assert one == one and one != two and len({one, two}) == 2
    grid = leeward.simulate(ROOT / "recordings" / "hover-grids")[0]
    assert grid == grid and len({grid}) == 1


@pytest.mark.parametrize("propellers", [-1, 0, 4.9, 2**40, np.nan, np.inf])
def test_a_number_of_propellers_that_cannot_be_is_refused(propellers):
    with pytest.raises(ValueError, match="propellers"):
        leeward.Air(leeward.Airframe("mine", 1.6, propellers, 0.2, 0.45))


def test_a_path_a_text_and_a_dict_are_the_same_scenario(tmp_path):
    path = tmp_path / "two.ron"
    path.write_text(TWO)
    plans = [leeward.plan(it) for it in (path, str(path), TWO, AS_DICT)]
    texts = {it._plan.json() for it in plans}
    assert len(texts) == 1
    first = plans[0]
    assert first.is_safe and first.names == ["lifter", "scout"]
    first.save(tmp_path / "plan.json")
    loaded = leeward.Plan.load(tmp_path / "plan.json")
    assert loaded.data["drones"] == first.data["drones"]


def test_a_dict_may_say_all_that_a_text_says(tmp_path, monkeypatch):
    light = {"mass_kg": 0.31, "propeller_diameter_m": 0.13, "motor_distance_m": 0.25}
    task = {"to_m": [10, 4, 3], "dwell_s": np.int64(2), "during_s": [np.float32(8), np.int64(12)]}
    drone = {"name": "a", "airframe": "my light", "start_m": np.array([2, 4, 3]), "tasks": [task]}
    scenario = {
        "name": "own",
        "bounds_m": {"min": (0, 0, 0), "max": (np.int64(12), 8, 6)},
        "air": {"convection": None},
        "airframes": {"my light": light},
        "drones": [drone],
    }
    found = leeward.plan(scenario)
    assert found.is_safe and found["a"]["airframe"]["mass_kg"] == 0.31
    assert found.data.get("air_delay") is None and found["a"]["arrives_s"] >= 12.0
    assert leeward.plan({**scenario, "air": {}}).data["air_delay"] is not None
    # A file whose name looks like a scenario.
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two (1).ron").write_text(TWO)
    assert leeward.plan("two (1).ron").names == ["lifter", "scout"]


def test_notes_say_which_rules_were_given_up():
    assert leeward.plan(TWO).notes == []
    barge = {
        "mass_kg": 6.0,
        "propeller_diameter_m": 0.5,
        "motor_distance_m": 0.9,
        "max_acceleration_mps2": 0.1,
    }
    drone = {**AS_DICT["drones"][0], "airframe": "barge"}
    given_up = leeward.plan({**AS_DICT, "airframes": {"barge": barge}, "drones": [drone]})
    assert any("straight motion" in note for note in given_up.notes), given_up.notes


def test_a_loaded_plan_is_what_its_trajectories_say(tmp_path):
    path = tmp_path / "plan.json"
    bodies = [[[1, 4, 3], [9, 4, 3]], [[9, 4, 3], [1, 4, 3]]]
    drones = [
        {"name": name, "airframe": "kolibri", "trajectory": {"t_s": [0, 6], "position_m": there}}
        for name, there in zip("ab", bodies)
    ]
    bounds = {"min": [0, 0, 0], "max": [10, 8, 6]}
    plan = {"format": "plan/2", "scenario": "head-on", "bounds_m": bounds, "drones": drones}
    path.write_text(json.dumps(plan))
    loaded = leeward.Plan.load(path)
    assert not loaded.is_safe and loaded.makespan_s == 6.0
    assert {it.kind for it in loaded.violations} == {it.kind for it in leeward.check(path).violations}
    path.write_text(json.dumps({**plan, "fleet": {"makespan_s": 1.0}}))
    differences = leeward.check(leeward.Plan.load(path)).differences
    assert [it["figure"] for it in differences] == ["fleet.makespan_s"]
    assert differences == leeward.check(path).differences


def test_positions_are_the_trajectories(warehouse):
    assert warehouse.is_safe and len(warehouse) == 12
    for drone in warehouse:
        there = np.asarray(drone["trajectory"]["position_m"])
        if drone["at_end"] != "leave":
            assert drone.position(drone.t_s) == pytest.approx(there, abs=1e-9)
    t_s, positions = warehouse.samples(0.5)
    assert positions.shape == (12, t_s.size, 3)
    leaves = leeward.plan(TWO)["scout"]
    assert np.isnan(leaves.position([0.0, 1e6])).tolist() == [[False] * 3, [True] * 3]
    assert "12 drones" in warehouse._repr_html_()
    with pytest.raises(ValueError):
        warehouse.times(0.0)


def test_all_that_is_wrong_with_a_scenario_is_data():
    text = TWO.replace("bounds_m", "bunds_m").replace('"kolibri"', '"kolbri"')
    with pytest.raises(leeward.ScenarioError) as caught:
        leeward.plan(text)
    assert isinstance(caught.value, ValueError)
    problems = caught.value.problems
    slip = next(it for it in problems if "bunds_m" in it.message)
    assert (slip.line, slip.column) == (3, 5) and "bounds_m" in slip.help
    unknown = next(it for it in problems if "airframe" in it.message)
    assert (unknown.line, unknown.column) == (6, 35) and "kolibri" in unknown.help
    with pytest.raises(leeward.ScenarioError):
        leeward.plan({**AS_DICT, "name": None})
    with pytest.raises(FileNotFoundError):
        leeward.plan("nothing.ron")
    with pytest.raises(ValueError, match="seconds|time"):
        leeward.plan(TWO, time_limit_s=-1.0)


def test_starts_that_exclude_one_another_are_told():
    text = TWO.replace("start_m: (10, 4, 1)", "start_m: (2, 4, 4.6)")
    with pytest.raises(leeward.Blocked) as caught:
        leeward.plan(text)
    conflict = caught.value.conflicts[0]
    assert {conflict.drone, conflict.with_} == {"lifter", "scout"}
    assert conflict.when == "starts" and conflict.meeting is None
    assert caught.value.more == 0
    drone = '(name: "{}", airframe: "kolibri", start_m: (5, 4, 2), tasks: [(to_m: ({}, 7, 2){})])'
    drones = ", ".join(drone.format(f"d{k}", 1 + k % 10, "") for k in range(60))
    head = 'Scenario(name: "spot", bounds_m: (min: (0, 0, 0), max: (12, 8, 6)), drones: ['
    with pytest.raises(leeward.Blocked) as caught:
        leeward.plan(head + drones + "])")
    told, more = len(caught.value.conflicts), caught.value.more
    assert more > 0 and str(caught.value).startswith(f"no plan can be safe: {told + more} pairs")
    drone = """(name: "d{0}", airframe: "kolibri", start_m: (5.{0}, 4, 2), tasks: [
        (to_m: (6, 7, 2), during_s: (20, 30)), (to_m: ({0}, 1, 2))])"""
    with pytest.raises(leeward.Blocked) as caught:
        leeward.plan(head + ", ".join(map(drone.format, (1, 2))) + "])")
    conflict = next(it for it in caught.value.conflicts if it.when == "tasks")
    assert conflict.meeting["task"] == conflict.meeting["their_task"] == 1
    assert conflict.meeting["during_s"] == [20, 30]


def test_check_finds_what_a_changed_plan_breaks(warehouse, tmp_path):
    found = leeward.check(warehouse, late=True)
    assert found.is_safe and len(found.late) == 12 and found.closest["gap_m"] > 0.0
    data = json.loads(warehouse._plan.json())
    for drone in data["drones"]:
        drone["air_limit"] = 0.01
    (tmp_path / "plan.json").write_text(json.dumps(data))
    broken = leeward.check(tmp_path / "plan.json")
    assert not broken.is_safe
    worst = max(broken.violations, key=lambda it: it.value)
    assert worst.kind == "air" and worst.value > worst.limit == 0.01
    (tmp_path / "plan.json").write_text("{}")
    with pytest.raises(leeward.PlanError):
        leeward.check(tmp_path / "plan.json")
    with pytest.raises(leeward.PlanError):
        leeward.Plan.load(tmp_path / "plan.json")
    assert found.untold == 0
    stays = {"t_s": [0, 0.1], "position_m": [[5, 5, 2], [5, 5, 2]]}
    one = {"airframe": "kolibri", "trajectory": stays}
    bounds_m = {"min": [0, 0, 0], "max": [9, 9, 6]}
    crowd = {"format": "plan/1", "scenario": "crowd", "bounds_m": bounds_m}
    crowd["drones"] = [{**one, "name": f"d{k}"} for k in range(70)]
    (tmp_path / "plan.json").write_text(json.dumps(crowd))
    untold = leeward.check(tmp_path / "plan.json").untold
    assert untold > 0 and leeward.Plan.load(tmp_path / "plan.json").untold == untold
    one |= {"name": "one", "at_start": "Flying", "airborne_s": "always"}
    (tmp_path / "plan.json").write_text(json.dumps(crowd | {"drones": [one]}))
    for read in (leeward.check, leeward.Plan.load):
        with pytest.raises(leeward.PlanError) as caught:
            read(tmp_path / "plan.json")
        messages = [it.message for it in caught.value.problems]
        assert len(messages) == 2 and caught.value.problems[0].line == 1
        for key in ("at_start", "airborne_s"):
            assert any(f"drones[0].{key}" in it for it in messages)
    (tmp_path / "show.skyc").write_bytes(b"PK\x03\x04\xff\xfe")
    for read in (leeward.check, leeward.Plan.load):
        with pytest.raises(leeward.PlanError, match="show.skyc is no text"):
            read(tmp_path / "show.skyc")


def test_a_plan_is_flown(warehouse):
    flown = leeward.fly(warehouse, gusts=0.0, convection=[1.0], until_s=4.0)
    assert len(flown.flights) == 1
    assert {it["name"] for it in flown.flights[0]["drones"]} == set(warehouse.names)
    again = leeward.fly(warehouse, gusts=0.0, convection=[1.0], until_s=4.0)
    assert again.data == flown.data
    with pytest.raises(ValueError, match="px4"):
        leeward.fly(warehouse, controllers=["px5"])
    for nothing in ({"controllers": []}, {"until_s": -1.0}, {"until_s": np.nan}):
        with pytest.raises(leeward.PlanError, match="controller|up to which"):
            leeward.fly(warehouse, **nothing)


def test_a_plan_is_a_page_with_and_without_its_scenario(two, tmp_path):
    def shown(page):
        assert page.startswith("<!DOCTYPE html>")
        data = re.search(r'<script id="scene" type="application/json">(.*?)</script>', page)
        return {it["name"]: [stop[2] for stop in it["stops"]] for it in json.loads(data[1])["drones"]}

    # What a dwell is the scenario says; without it only a stop between two moves is one.
    assert shown(two.page()) == {"lifter": [], "scout": ["dwell"]}
    two.save(tmp_path / "plan.json")
    loaded = leeward.Plan.load(tmp_path / "plan.json")
    assert shown(loaded.page()) == {"lifter": [], "scout": []}


def test_a_plan_is_exported_to_every_format(two, tmp_path):
    at = (47.4, 8.55, 488.0, 30.0)
    two.save(tmp_path / "plan.json")
    saved = hashlib.sha256((tmp_path / "plan.json").read_bytes()).hexdigest()[:16]
    for to, suffix in [
        ("setpoints", ".csv"),
        ("crazyswarm", ".cfpoly"),
        ("skybrush", ".skyc"),
        ("mcap", ".mcap"),
        ("czml", ".czml"),
        ("qgc", ".plan"),
    ]:
        found = two.export(
            to,
            tmp_path / to,
            georeference=None if to in ("crazyswarm", "mcap") else at,
            compressed=to == "crazyswarm",
            untimed_ok=to == "qgc",
        )
        written = json.loads((tmp_path / to / "export.json").read_text())
        assert written == found.data and written["to"] == to
        assert written["plan"]["id"] == saved, "as `plan export` names the saved file"
        assert all(it.stat().st_size > 0 for it in found.files)
        assert any(it.suffix == suffix for it in found.files)
        assert 0.0 <= found.deviation_m < 0.1


def test_exports_are_refused_with_the_reason_and_replace_what_was_there(two, tmp_path):
    for to, more, told in [
        ("kml", {}, "there is no format"),
        ("czml", {}, "lies on the Earth"),
        ("setpoints", {"frame": "enu "}, "ned or enu"),
        ("setpoints", {"rate_hz": 0.5}, "within 2 to 1000"),
        ("czml", {"georeference": (91, 0, 0, 0)}, "latitude must lie within"),
    ]:
        with pytest.raises(ValueError, match=told):
            two.export(to, tmp_path / "none", **more)
    with pytest.raises(leeward.PlanError, match="untimed_ok=True"):
        two.export("qgc", tmp_path / "none", georeference=(47, 8, 400, 0))
    assert not (tmp_path / "none").exists()
    data = json.loads(json.dumps(two.data))
    # Through the roof.
    path = data["drones"][1]["trajectory"]
    path["position_m"] = [[x, y, z + 9] for x, y, z in path["position_m"]]
    path["control_m"] = [[[x, y, z + 9] for x, y, z in it] for it in path["control_m"]]
    (tmp_path / "above.json").write_text(json.dumps(data))
    with pytest.raises(leeward.PlanError, match="violations"):
        leeward.Plan.load(tmp_path / "above.json").export("mcap", tmp_path / "none")
    first = two.export("mcap", tmp_path / "out")
    second = two.export("setpoints", tmp_path / "out", frame="enu", own_origin=True)
    assert not any(it.exists() for it in first.files) and all(it.exists() for it in second.files)
    assert second.data["axes"]["frame"] == "enu" and second.lost


def test_a_plan_is_changed_while_it_is_flown(warehouse):
    running = leeward.Running(warehouse)
    late = warehouse.names[0]
    told = running.replan(3.0, [leeward.Late(late, 1.0)])
    assert [it["drone"] for it in told.changed if it["cause"] == "late"] == [late]
    assert running.plan.violations == []
    changed = {it["drone"] for it in told.changed}
    for drone in warehouse:
        is_same = running.plan[drone.name]["trajectory"] == drone["trajectory"]
        assert is_same == (drone.name not in changed)
    behind = running.plan[late].position(3.0)
    assert behind == pytest.approx(warehouse[late].position(2.0), abs=1e-6)
    with pytest.raises(leeward.ChangeError) as caught:
        running.replan(4.0, [leeward.Removed("ghost"), leeward.Late(late, -1.0)])
    assert len(caught.value.problems) == 2
    to = tuple(warehouse[late].position(2.0)[0])
    told = running.replan(4.0, [leeward.Retasked(late, [leeward.Task(to, dwell_s=1.0)])])
    assert not told.refused and running.plan.violations == []


def test_a_loaded_plan_needs_its_scenario(warehouse, tmp_path):
    warehouse.save(tmp_path / "plan.json")
    loaded = leeward.Plan.load(tmp_path / "plan.json")
    with pytest.raises(leeward.ChangeError, match="scenario"):
        leeward.Running(loaded)
    assert len(leeward.Running(loaded, WAREHOUSE).plan) == 12
    with pytest.raises(leeward.ChangeError):
        leeward.Running(loaded, TWO)


def test_a_recording_is_diagnosed_simulated_and_calibrated(tmp_path):
    found = leeward.diagnose(ROOT / "recordings" / "draughty-hall")
    assert [it.verdict for it in found] == ["library"]
    assert [it["name"] for it in found[0].effects] == ["crossflow"]
    assert found[0].data["format"] == "diagnosis/1"
    assert found[0].data["remarks"] == []
    assert "crossflow" in found[0].finding_ron and "crossflow" in found[0]._repr_html_()
    grids = ROOT / "recordings" / "hover-grids"
    fits = leeward.calibrate(grids)
    assert fits.verdict == "fits" and fits.jet_ron.strip()
    assert fits.data["format"] == "calibration/1"
    assert "no value in any row" in fits.data["remarks"][0]["message"]
    simulated = leeward.simulate(grids)
    assert [it.recording for it in simulated] == sorted(it.recording for it in simulated)
    one = simulated[0]
    assert one.position_m.shape == (one.recorded.size, 3) and set(one.channel) == {"speed"}
    assert np.abs(one.residual).mean() < 0.5 * np.abs(one.recorded).mean()


def test_a_recording_that_cannot_be_read_is_told_at_its_place(tmp_path):
    with pytest.raises(FileNotFoundError):
        leeward.diagnose(tmp_path / "nothing")
    with pytest.raises(leeward.RecordingError) as caught:
        leeward.diagnose(tmp_path)
    assert "meta.json" in caught.value.problems[0].help
    broken = tmp_path / "broken"
    broken.mkdir()
    source = ROOT / "recordings" / "draughty-hall"
    for file in source.iterdir():
        (broken / file.name).write_bytes(file.read_bytes())
    lines = (broken / "probes.csv").read_text().splitlines()
    header = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    lines[header + 3] = re.sub(r"^[^,]*", "many", lines[header + 3])
    (broken / "probes.csv").write_text("\n".join(lines))
    with pytest.raises(leeward.RecordingError) as caught:
        leeward.diagnose(broken)
    problem = caught.value.problems[0]
    assert problem.file == str(broken / "probes.csv") and problem.line == header + 4
    with pytest.raises(leeward.RecordingError, match="no flight log"):
        leeward.diagnose(broken / "meta.json")


CAMPAIGN = """(
    name: "hall", air: (temperature_c: 20, pressure_pa: 101325), floor_z_m: -10,
    acceleration: SpecificForceInBody, clock: Shared,
    types: { "t": (mass_kg: Stated(1), propeller_diameter_m: Stated(0.2),
        motor_distance_m: Stated(0.4), rotor_offset_m: Stated((0, 0, 0))) },
    vehicles: { "a": "t", "b": "t" },
)"""


def logs_of_two(folder, flights):
    """Flights of one drone that swings above another: thrust as it is, but for a push below."""
    folder.mkdir(exist_ok=True)
    (folder / "campaign.ron").write_text(CAMPAIGN)
    columns = "t_s,vehicle,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qx,qy,qz,qw,thrust_n"
    for flight in range(flights):
        rng = np.random.default_rng(flight)
        lines = [columns]
        for k in range(3000):
            t_s = 0.02 * k
            for name, z_m, rate in (("a", 3.0, 0.4 + 0.01 * flight), ("b", 2.0, 0.0)):
                x_m, vx = 2.0 * np.sin(rate * t_s), 2.0 * rate * np.cos(rate * t_s)
                push_n = -0.8 * np.exp(-((2.0 * np.sin((0.4 + 0.01 * flight) * t_s)) ** 2) / 0.05)
                push_n *= name == "b"
                thrust_n = 9.81 + 0.3 * np.sin(1.3 * t_s) + 0.02 * rng.standard_normal()
                az = thrust_n + push_n
                row = [t_s, name, x_m, 0, z_m, vx, 0, 0, 0, 0, az, 0, 0, 0, 1, thrust_n]
                lines.append(",".join(f"{it:.4f}" if isinstance(it, float) else str(it) for it in row))
        (folder / f"f{flight}.csv").write_text("\n".join(lines) + "\n")


def test_forces_of_flight_logs_are_simulated(tmp_path):
    logs_of_two(tmp_path / "hall", 2)
    for one in leeward.simulate(tmp_path / "hall"):
        assert set(one.channel) == {"vertical_force"} and one.recorded.size > 1000
        below = one.subject == 1
        # The drone below is pushed down, as recorded and as simulated; the other is not.
        assert one.recorded[below].min() < -0.4 and one.simulated[below].min() < -0.1
        assert (one.simulated[~below] == 0.0).all()


def test_logs_that_tell_no_force_are_left_out_with_what_they_lack(tmp_path):
    hall = tmp_path / "hall"
    logs_of_two(hall, 2)
    text = (hall / "f1.csv").read_text()
    (hall / "bare.csv").write_text("\n".join(it.rsplit(",", 1)[0] for it in text.splitlines()) + "\n")
    (hall / "same.csv").write_text(text)
    bare = next(it for it in leeward.simulate(hall) if it.recording == "bare")
    assert bare.recorded.size == 0 and "motors" in bare.left_out[0]
    with pytest.raises(leeward.RecordingError, match="lacks motors"):
        leeward.diagnose(hall / "bare.csv")
    with pytest.raises(leeward.RecordingError, match="lacks motors"):
        leeward.simulate(hall / "bare.csv")
    # Two that are left are too few to hold any out.
    with pytest.raises(leeward.RecordingError, match="at least.*; bare: is left out: .* lacks motors"):
        leeward.diagnose(hall)
    told = [it["message"] for it in leeward.simulate(hall)[0].remarks]
    assert f"{hall / 'same.csv'} is a copy of {hall / 'f1.csv'}: one flight" in told
    logs_of_two(hall, 6)
    (found,) = leeward.diagnose(hall)
    told = [it["message"] for it in found.data["remarks"] if it["recording"] == "bare"]
    assert len(told) == 1 and told[0].startswith("is left out: no force") and "`a` lacks" in told[0]
    with pytest.raises(leeward.RecordingError, match="no flight logs: draughty-hall"):
        leeward.diagnose([hall, ROOT / "recordings" / "draughty-hall"])


def test_logs_that_a_campaign_joins_are_one_recording(tmp_path):
    hall = tmp_path / "hall"
    logs_of_two(hall, 1)
    header, *rows = (hall / "f0.csv").read_text().splitlines()
    columns = header.replace(",vehicle", "")
    for name in ("a", "b"):
        own = [",".join((t_s, *rest)) for t_s, of, *rest in (it.split(",") for it in rows) if of == name]
        (hall / f"of_{name}.csv").write_text("\n".join([columns, *own]) + "\n")
    text = CAMPAIGN.rstrip().removesuffix(")")
    noon = 'joined: { "noon": { "a": "of_a", "b": "of_b" } }, starts_s: { "of_a": 5, "of_b": 5 },)'
    (hall / "campaign.ron").write_text(text + noon)
    apart, joined = leeward.simulate(hall)
    assert (apart.recording, joined.recording) == ("f0", "noon")
    assert joined.recorded.size > 1000 and np.isin([0, 1], joined.subject).all()
    (hall / "of_b.csv").unlink()
    with pytest.raises(leeward.RecordingError, match="`of_b` of flight `noon` is not among the logs"):
        leeward.simulate(hall)


def test_of_a_folder_what_cannot_be_read_is_left_out_with_a_remark(tmp_path):
    source = ROOT / "recordings" / "draughty-hall"
    for name in ("sound", "spoilt", "bare"):
        (tmp_path / name).mkdir()
        for file in source.iterdir():
            (tmp_path / name / file.name).write_bytes(file.read_bytes())
    (tmp_path / "spoilt" / "meta.json").write_text("{\n")
    (tmp_path / "bare" / "meta.json").unlink()
    (found,) = leeward.diagnose(tmp_path)
    assert found.recording == "sound" and found.verdict == "library"
    told = {it["recording"]: it["message"] for it in found.data["remarks"]}
    assert told["spoilt"].startswith(f"{tmp_path / 'spoilt'} is left out: ")
    assert f"{tmp_path / 'spoilt' / 'meta.json'}:2: is no JSON" in told["spoilt"]
    assert told["bare"].endswith(f"{tmp_path / 'bare' / 'meta.json'}: is missing")
    assert {it["recording"] for it in leeward.simulate(tmp_path)[0].remarks} == {"spoilt", "bare"}
    # One that is named must be in order.
    with pytest.raises(leeward.RecordingError, match="spoilt") as caught:
        leeward.diagnose([tmp_path / "sound", tmp_path / "spoilt"])
    (problem,) = caught.value.problems
    assert problem.file == str(tmp_path / "spoilt" / "meta.json") and problem.line == 2


def test_what_says_nothing_of_a_format_is_refused_and_folders_of_others_are_left_alone(two, tmp_path):
    for to, options in (
        ("mcap", {"georeference": (47.4, 8.5, 488.0, 0.0)}),
        ("mcap", {"frame": "ned"}),
        ("skybrush", {"rate_hz": 50.0}),
        ("setpoints", {"compressed": True}),
        ("setpoints", {"untimed_ok": True}),
    ):
        with pytest.raises(ValueError, match=f"{next(iter(options))} is for .* nothing of {to}"):
            two.export(to, tmp_path / "o", **options)
    two.save(tmp_path / "plan.json")
    with pytest.raises(leeward.PlanError, match="holds what `plan SCENARIO` wrote"):
        two.export("setpoints", tmp_path)
    assert {it.name for it in tmp_path.iterdir()} == {"plan.json"}


def test_a_loaded_plan_is_called_what_its_file_is_called(two, tmp_path):
    path = tmp_path / "plan.json"
    path.write_bytes(json.dumps(two.data).encode() + b"\r\n")
    named = leeward.Plan.load(path).export("setpoints", tmp_path / "o").data["plan"]["id"]
    assert named == hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def test_plans_and_air_go_to_other_processes(two):
    back = pickle.loads(pickle.dumps(two))
    assert back.data == two.data and back.notes == two.notes and back.status == two.status
    t_s = back.times(0.5)
    assert np.array_equal(back["scout"].position(t_s), two["scout"].position(t_s), equal_nan=True)
    air = leeward.Air("kolibri", 0.3, temperature_c=5.0)
    below = [[0.0, 0.1, -1.0]]
    assert (pickle.loads(pickle.dumps(air)).speed(below) == air.speed(below)).all()
    found = leeward.separation("kolibri", under=air)
    assert copy.deepcopy(found).depth_needed_m(0.3) == found.depth_needed_m(0.3)
    with pytest.raises(ValueError, match=r"xyz: shape \(1, 1, 3\)"):
        air.speed([below])


def test_errors_say_where_in_a_dict():
    nowhere = {**AS_DICT, "drones": [{**AS_DICT["drones"][0], "start_m": (1.0, 1.0, np.nan)}]}
    with pytest.raises(leeward.ScenarioError, match=r"`drones\[0\]\.start_m\[2\]`: nan") as caught:
        leeward.plan(nowhere)
    assert caught.value.problems[0].file == "scenario"
    with pytest.raises(TypeError, match=r"drones\[0\]\.start_m is a"):
        leeward.plan({**AS_DICT, "drones": [{"start_m": object()}]})


def test_of_a_text_that_is_no_plan_the_file_is_told(tmp_path):
    cut = tmp_path / "cut.json"
    cut.write_text("{")
    for read in (leeward.Plan.load, leeward.check):
        with pytest.raises(leeward.PlanError) as caught:
            read(cut)
        assert str(caught.value).startswith(f"{cut}: `.`: EOF while parsing")
        (problem,) = caught.value.problems
        assert (problem.file, problem.line) == (str(cut), 1)


def test_what_is_no_number_and_no_drone_is_refused(two):
    assert "scout" in two and two["scout"] in two and "ghost" not in two and 3 not in two
    scout = two["scout"]
    for wrong, error in [(np.nan, ValueError), ([0.0, np.inf], ValueError), (None, TypeError)]:
        with pytest.raises(error, match="t_s"):
            scout.position(wrong)
    for wrong in (np.nan, np.inf, 0.0):
        with pytest.raises(ValueError, match="dt_s"):
            two.samples(wrong)
    masked = np.ma.array([[0.0, 0.0, -1.0]], mask=[[0, 0, 1]])
    air = leeward.Air("kolibri")
    with pytest.raises(ValueError, match="xyz has masked"):
        air.speed(masked)
    with pytest.raises(ValueError, match="t_s has masked"):
        scout.position(masked[0])
    with pytest.raises(ValueError, match="depths_m has masked"):
        leeward.separation("kolibri", under="kolibri", depths_m=np.ma.masked_less([0.5, 2.0], 1.0))
    # Nothing is lost of one without a masked value.
    assert air.speed(np.ma.array([[0.0, 0.0, -1.0]])) == air.speed([0.0, 0.0, -1.0])


def test_what_is_of_another_kind_is_told(two):
    with pytest.raises(TypeError, match="plan is a str; a Plan is wanted"):
        leeward.fly("plan.json")
    with pytest.raises(TypeError, match="plan is a str; a Plan is wanted"):
        leeward.Running("plan.json")
    with pytest.raises(TypeError, match="receiver is a str; an Air is wanted"):
        leeward.Air("kolibri").mean_over_discs("kolibri", [0.0, 0.0, -2.0])
    running = leeward.Running(two)
    with pytest.raises(TypeError, match="'x' is no change"):
        running.replan(3.0, ["x"])
    with pytest.raises(TypeError, match="a list of them"):
        running.replan(3.0, leeward.Removed("scout"))


def test_ctrl_c_stops_planning():
    # A process that is started in the background inherits that it ignores the signal.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Some seconds of work.
    smooth = WAREHOUSE.read_text().replace("bounds_m:", "planning: (motion: Smooth), bounds_m:", 1)
    planned = []
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    begun = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        planned.append(leeward.plan(smooth))
        time.sleep(5.0)
    assert not planned, "it was planned before the signal came"
    assert time.monotonic() - begun < 3.0
    # And the next call is not stopped.
    assert leeward.plan(TWO).is_safe


def test_other_threads_go_on_meanwhile():
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.monotonic()
    leeward.plan(WAREHOUSE)
    done.set()
    thread.join()
    assert len(ticks) > 5.0 * (ticks[-1] - begun)


def test_without_numpy_it_is_told():
    code = "import sys; sys.modules['numpy'] = None; import leeward"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    assert "leeward needs numpy" in done.stderr and "pip install numpy" in done.stderr


def test_pandas_is_optional(warehouse):
    pandas = pytest.importorskip("pandas")
    assert list(warehouse.to_pandas().index) == warehouse.names
    table = leeward.separation("kolibri", under="kolibri").to_pandas()
    assert isinstance(table, pandas.DataFrame) and len(table) == 280


def test_its_version_is_the_workspace_s_and_its_first_example_is_true():
    stated = re.search(r'\[workspace\.package\]\nversion = "(.*)"', (ROOT / "Cargo.toml").read_text())
    assert leeward.__version__ == stated.group(1)
    assert doctest.testmod(leeward).failed == 0


@pytest.mark.parametrize("script", sorted((ROOT / "python" / "examples").glob("*.py")), ids=lambda it: it.stem)
def test_every_script_runs(script, tmp_path):
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()

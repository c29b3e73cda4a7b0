"""A show planned, checked, flown in the simulation, and exported for Crazyflies and Skybrush."""

import leeward

# Eight Crazyflies from a row on the floor to a ring, held, and home.
RING_M = [(2.0, 0.0), (1.4, 1.4), (0.0, 2.0), (-1.4, 1.4), (-2.0, 0.0), (-1.4, -1.4), (0.0, -2.0), (1.4, -1.4)]
show = {
    "name": "ring",
    "bounds_m": {"min": (-4, -4, 0), "max": (4, 4, 4)},
    "drones": [
        {
            "name": f"cf{k + 1}",
            "airframe": "crazyflie-2.1",
            "start_m": (-3.0 + 0.8 * k, -3.2, 1.0),
            "tasks": [
                {"to_m": (x, y, 2.0 + 0.1 * (k % 2)), "dwell_s": 5.0},
                {"to_m": (-3.0 + 0.8 * k, -3.2, 1.0)},
            ],
        }
        for k, (x, y) in enumerate(RING_M)
    ],
}

try:
    plan = leeward.plan(show)
except leeward.ScenarioError as error:
    for problem in error.problems:
        print(f"{problem.line}:{problem.column}: {problem.message}; {problem.help}")
    raise

print(plan, "checked:", leeward.check(plan).is_safe)
plan.save("ring.json")

flown = leeward.fly(plan, feed_forward=["none", "late"], seed=1)
for flight in flown.flights:
    worst = max(flight["drones"], key=lambda it: it["tracking_max_m"])
    print(
        f"{flight['feed_forward']:>5}, air at {flight['convection']} of the centreline:"
        f" {worst['name']} up to {worst['tracking_max_m']:.3f} m off"
    )

for to in ["crazyswarm", "skybrush"]:
    made = plan.export(to, f"ring-{to}", compressed=to == "crazyswarm")
    print(f"{to}: {len(made.files)} files, {1e3 * made.deviation_m:.1f} mm off the plan at most")
    for lost in made.lost:
        print(f"  {lost}")

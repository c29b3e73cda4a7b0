"""A show planned, checked, flown in the simulation, and handed on as setpoints."""

import csv

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

t_s, position_m = plan.samples(dt_s=0.1)
with open("ring.csv", "w", newline="") as file:
    rows = csv.writer(file)
    rows.writerow(["t_s", "drone", "x_m", "y_m", "z_m"])
    for name, path_m in zip(plan.names, position_m):
        rows.writerows([f"{t:.1f}", name, *place] for t, place in zip(t_s, path_m))
print(f"wrote ring.json and ring.csv, {t_s.size} moments of {len(plan)} drones")

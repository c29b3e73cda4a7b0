"""A loop that flies a plan, hears of drones that are late, and plans on."""

from pathlib import Path

import leeward

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "warehouse.ron"

plan = leeward.plan(SCENARIO)
running = leeward.Running(plan)
print(plan)

# What a tracking system would tell: at a time, who is behind by how much (s).
heard = {3.0: [("scan-1", 0.8)], 9.0: [("scan-1", 0.5)]}

for at_s in range(1, 15):
    late = heard.get(float(at_s))
    if not late:
        continue
    told = running.replan(at_s, [leeward.Late(drone, by_s) for drone, by_s in late])
    for it in told.changed:
        print(f"{at_s:4.1f} s: {it['drone']} flies another path now ({it['cause']})")
    for it in told.unavoidable:
        print(f"{at_s:4.1f} s: too late to avoid: {it}")
    ahead = [it for it in running.plan.violations if it.until_s is None or it.until_s > at_s]
    assert all(it in told.unavoidable for it in ahead), "a plan that is handed out is verified"

print(running.plan)

"""A recording diagnosed: which physics its simulation leaves out, and the finding planned with."""

from pathlib import Path

import numpy as np

import leeward

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "recordings" / "draughty-hall"

before = leeward.simulate(RECORDING)[0]
rms = np.sqrt(np.mean(before.residual**2))
print(f"{before.recorded.size} readings, simulated with {rms:.3f} m/s rms error")

(found,) = leeward.diagnose(RECORDING)
print(f"{found.recording}: {found.verdict}")
for effect in found.effects:
    print(f"  {effect['name']}: {effect['story']}")
    for name, it in effect["parameters"].items():
        print(f"    {name} {it['value']:.2f} {it['unit']} ({it['low']:.2f} to {it['high']:.2f})")

Path("finding.ron").write_text(found.finding_ron)
scenario = ROOT / "scenarios" / "warehouse.ron"
for name, finding in [("through it", "finding.ron"), ("without it", None)]:
    plan = leeward.plan(scenario, finding=finding)
    worst_mps = max(drone["worst_air_mps"] for drone in plan)
    print(f"planned {name}: {plan.status}, {plan.makespan_s:.1f} s, at worst {worst_mps:.2f} m/s of air")

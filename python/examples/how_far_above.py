"""How far must A stay above B? In depth, and with payload and distance beside."""

import leeward

LIMIT = 0.3  # mean air over the lower drone's discs, over its induced velocity

for upper, lower in [("crazyflie-2.1", "crazyflie-2.1"), ("matrice-300", "kolibri"), ("kolibri", "matrice-300")]:
    depth_m = leeward.separation(lower, under=upper).depth_needed_m(LIMIT)
    if depth_m == 0.0:
        print(f"{upper} above {lower}: alpha {LIMIT} is exceeded at no depth")
        continue
    there = leeward.separation(lower, under=upper, depths_m=[depth_m], offsets_m=[0.0])
    print(
        f"{upper} at least {depth_m:.2f} m above {lower}: alpha {there.alpha[0, 0]:.2f},"
        f" {100 * (there.power[0, 0] - 1):.0f} % more power to hover"
    )

laden = leeward.Air("matrice-300", mass_kg=9.0, temperature_c=30.0)
found = leeward.separation("kolibri", under=laden, offsets_m=[0.0, 1.0, 2.0])
for offset_m in found.offset_m:
    print(f"below a laden matrice-300, {offset_m:.0f} m beside: {found.depth_needed_m(LIMIT, offset_m):.2f} m")

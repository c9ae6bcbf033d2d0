# %% [markdown]
# # Read the sensitivities
#
# Which number of the machine would you change first? Every result here has exact derivatives with respect to every number: gains, dimensions, ply angles, stiffnesses.
# One reverse sweep through the model gives them all.

# %%
import numpy as np

import amb_design as ad

machine = ad.load("thesis-tuned")
limit = ad.stability_limit(machine)
gradient = ad.stability_gradient(machine, limit.mode)
slope = gradient["controller.kd"]
print(f"{len(gradient)} derivatives; that of kd is {slope:.4g} (rad/s) per second")

# %% [markdown]
# Derivatives in different units do not compare. Relative ones do: per cent of the limit for a per cent of the number; for angles, per degree.

# %%
numbers = dict(ad.numbers(machine))
effect = {}
for path, slope in gradient.items():
    step = np.radians(1.0) if path.endswith("angle") else 0.01 * abs(numbers[path])
    effect[path] = 100.0 * slope * step / limit.speed
for path in sorted(effect, key=lambda p: -abs(effect[p]))[:12]:
    print(f"{path:42s} {effect[path]:+7.3f} %")

# %% [markdown]
# Does it hold? A thousandth more of the gain `kd`, predicted and computed:

# %%
step = 0.001 * machine.controller.kd
damped = ad.replace(machine, {"controller.kd": machine.controller.kd + step})
computed = ad.stability_limit(damped).speed
predicted = limit.speed + gradient["controller.kd"] * step
print(f"from {limit.speed:.4f} to {predicted:.4f}; computed {computed:.4f} rad/s")

# %% [markdown]
# ## Ply by ply
#
# Which ply should turn, and which way? One degree more for each ply, from the inside out:

# %%
import matplotlib.pyplot as plt

plies = list(ad.find(machine, "plies.angle"))
fig, ax = plt.subplots(figsize=(6.3, 2.4))
ax.bar(range(len(plies)), [gradient[p] * np.radians(1) / ad.rpm(1) for p in plies])
ax.set_xticks(range(len(plies)), [f"{np.degrees(numbers[p]):.0f}°" for p in plies])
ax.set_xlabel("ply angle, from the inside out")
ax.set_ylabel("rpm per degree")
line = ax.axhline(0.0, color="black", lw=0.6)

# %% [markdown]
# In a balanced wall a ply at 0 or 90 degrees would not care which way it turns. This wall is not balanced: its ply at -45 degrees lies outside the one at 45 degrees, so that bending
# and twisting are coupled, and turning the plies along the axis the other way raises the limit, the outer ones most. First derivatives say nothing of large
# turns; those are for [the optimiser](codesign.py).
#
# ## Other results
#
# A critical speed and any eigenvalue have gradients too.

# %%
first = next(c for c in ad.critical_speeds(machine) if c.whirl == "forward")
slopes = ad.critical_speed_gradient(machine, first)
for path in sorted(slopes, key=lambda p: -abs(slopes[p] * numbers[p]))[:5]:
    print(f"{path:42s} {slopes[path] * numbers[path] / first.speed:+.3f} % per %")

# %% [markdown]
# The design of a problem ranks its own in `design.sensitivities`, and `ad.relaxations(design)` says what easing each active limit by 10 % would bring.

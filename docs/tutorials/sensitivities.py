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
print(f"{len(gradient)} derivatives, for example {gradient['controller.kd']:.4g} (rad/s) per second of kd")

# %% [markdown]
# Derivatives in different units do not compare. Relative ones do: per cent of the limit for a per cent of the number; for angles, per degree.

# %%
numbers = dict(ad.numbers(machine))
effect = {
    path: slope * (np.radians(1.0) if path.endswith("angle") else 0.01 * abs(numbers[path])) / limit.speed * 100.0
    for path, slope in gradient.items()
}
for path in sorted(effect, key=lambda p: -abs(effect[p]))[:12]:
    print(f"{path:42s} {effect[path]:+7.3f} %")

# %% [markdown]
# Numbers that differ between two ends of the machine are listed apart; a short path ties them. The gain `kd` in both loops, say:

# %%
step = 1.001
changed = ad.replace(machine, {"controller.kd": step * machine.controller.kd})
predicted = limit.speed + gradient["controller.kd"] * (step - 1.0) * machine.controller.kd
print(f"predicted {predicted:.4f} rad/s, computed {ad.stability_limit(changed).speed:.4f} rad/s")

# %% [markdown]
# ## Ply by ply
#
# Which ply should turn, and which way? One degree more for each ply, from the inside out:

# %%
import matplotlib.pyplot as plt

plies = [f"rotor.shaft.segments[0].plies[{k}].angle" for k in range(len(machine.rotor.shaft.segments[0].plies))]
fig, ax = plt.subplots(figsize=(6.3, 2.4))
ax.bar(range(len(plies)), [np.radians(1.0) * gradient[p] * 30.0 / np.pi for p in plies])
ax.set_xticks(range(len(plies)), [f"{np.degrees(numbers[p]):.0f}°" for p in plies])
ax.set_xlabel("ply angle, from the inside out")
ax.set_ylabel("rpm per degree")
ax.axhline(0.0, color="black", lw=0.6);

# %% [markdown]
# Plies at 0 and 90 degrees do not care which way they turn: by symmetry their first derivative is nearly zero (not quite, since the plies at 45 degrees are not
# balanced through the wall), and only larger angles tell. That is what [the optimiser](codesign.py) is for.
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

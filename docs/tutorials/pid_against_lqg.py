# %% [markdown]
# # PID against a regulator with observer
#
# On the same machine, with the same limits and the same optimiser: what does a quadratic regulator with Kalman observer (LQG) gain over the PID chain, and what does it cost?
# The packaged problem `thesis-pid-vs-lqg` holds one optimum for each; [controllers](../controllers.md) explains the laws.

# %%
import numpy as np

import amb_design as ad

pid = ad.load_optimum("thesis-pid-vs-lqg")
lqg = ad.load_optimum("thesis-pid-vs-lqg", "lqg")
w = lqg.controller
print(f"{w.current:.3g} A weigh as much as {w.displacement:.3g} m")

# %% [markdown]
# An LQG is written as weights and noises in physical units. `ad.synthesise` shows the gains that follow: a state space that serves all magnets, here with
# complex states, for y + i z.

# %%
law = ad.synthesise(lqg).controller
print(f"{type(law).__name__}: {law.law.states} states, {law.law.ports} inputs")

# %% [markdown]
# ## Under the same conditions
#
# Conditions that are left out are chosen from the machines, and the notes below the table say how. Four random machines are few; they keep this page quick.

# %%
table = ad.compare(
    {"PID": pid, "LQG": lqg},
    speed=ad.rpm(13900),
    unbalance={"in phase": [2e-5, 2e-5, 2e-5]},
    sensor_noise=2e-9,
    force_step=ad.ForceStep(force=50.0, at="disk 2"),
    tolerances={"magnets.current_stiffness": 0.05, "bearings.stiffness": 0.05},
    samples=4,
)
print(table)

# %% [markdown]
# Better entries carry a star. The observer wins most lines: it knows the force that limits this rotor, the internal damping of its laminate, and how that force grows with
# the speed; the PID can only damp. What it costs stands at the bottom: more than twice the states, and a model of the rotor in the controller.
#
# ## In pictures

# %%
machines = {"PID": pid, "LQG": lqg}
speeds = ad.rpm(np.linspace(0.0, 20000.0, 81))
diagrams = {name: ad.campbell(m, speeds) for name, m in machines.items()}
limits = {name: ad.stability_limit(m) for name, m in machines.items()}
ax = ad.plots.real_parts(diagrams, limits)

# %% [markdown]
# The loops' sensitivities at rest and at full speed, with the zones of ISO 14839-3:

# %%
ends = (0.0, ad.rpm(13900))
axes = ad.plots.sensitivities(
    [{name: ad.sensitivity(m, s) for name, m in machines.items()} for s in ends]
)

# %% [markdown]
# And 50 N that suddenly press on the middle disk:

# %%
steps = {name: design.force_steps[0] for name, design in table.designs.items()}
axes = ad.plots.responses(steps)

# %% [markdown]
# What observer, integral action and hardware cost against the ideal regulator of the same weights, which knows the whole state and has no amplifier:

# %%
limits["ideal"] = ad.stability_limit(ad.ideal(lqg))
for name, limit in limits.items():
    print(f"{name:6s} {limit.speed_rpm:6.0f} rpm")

# %% [markdown]
# # Analyse a rotor
#
# A composite shaft with three disks on two ball bearings and two magnets, from a 2014 thesis. How fast may it spin, and what limits it?

# %%
import numpy as np

import amb_design as ad

machine = ad.load("thesis-tuned")
limit = ad.stability_limit(machine)
print(f"{limit.status}: {limit.speed_rpm:.0f} rpm, certified: {limit.certified}")
print(limit.mode.describe())

# %%
diagram = ad.campbell(machine)
ax = ad.plots.campbell(diagram, limit=limit)

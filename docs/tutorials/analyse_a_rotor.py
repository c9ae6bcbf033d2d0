# %% [markdown]
# # Analyse a rotor
#
# A shaft of carbon fibre with three heavy disks runs on two passive bearings, each with a magnetic bearing beside it (D. Ahmad, NIT Rourkela, 2014). How fast may it spin, what limits it, and
# would a standard accept it?

# %%
import textwrap

import numpy as np

import amb_design as ad

machine = ad.load("thesis-tuned")
ax = ad.plots.machine(machine)

# %% [markdown]
# ## How fast, and what limits it
#
# The **stability limit speed** is the speed up to which every eigenvalue of rotor *and* controller has a negative real part. It is certified: the walk from rest to the limit leaves no
# gap between its steps ([theory](../theory.md)).

# %%
limit = ad.stability_limit(machine)
print(f"{limit.status}: {limit.speed_rpm:.0f} rpm, certified: {limit.certified}")
print(f"set by the {limit.mode.describe()}")

# %%
diagram = ad.campbell(machine)
ax = ad.plots.campbell(diagram, limit=limit)

# %% [markdown]
# Colours show damping: the first forward mode loses it with speed, since the damping in the rotating laminate feeds forward whirl above the first critical speed. The mode at the
# limit, as a shape along the shaft:

# %%
ax = ad.plots.mode_shape(limit.mode, machine)

# %% [markdown]
# ## Critical speeds

# %%
for c in ad.critical_speeds(machine):
    print(f"{c.speed_rpm:7.0f} rpm  {c.whirl:8s}  damping {c.damping_ratio:.4f}")

# %% [markdown]
# Forward critical speeds answer to unbalance. The machine's own unbalance, 0.2 mm of eccentricity at each disk, is far beyond what the magnets can hold; the response
# is linear, so the picture scales.

# %%
response = ad.unbalance_response(machine, ad.rpm(np.arange(100, 9300, 20)))
ax = ad.plots.unbalance(response)

# %% [markdown]
# ## What a standard and an experienced engineer would say
#
# `ad.analyse` does all of this at once; `amb-design analyse thesis-tuned --out results` prints it and writes a report.

# %%
result = ad.analyse(machine)
for c in result.criteria:
    print(f"{c.standard:12s} {c.subject:36s} {c.verdict:11s} {c.where}")

# %%
for finding in result.findings:
    text = f"- {finding.topic}: {finding.text}"
    print(textwrap.fill(text, 84, subsequent_indent="  "))

# %% [markdown]
# The sensitivity of each loop (ISO 14839-3: a peak below 3 is zone A), at rest and at 9000 rpm:

# %%
for rpm in (0, 9000):
    for peak in ad.sensitivity(machine, ad.rpm(rpm)).peaks:
        print(f"{rpm:5d} rpm, {peak.loop}: {peak.value:.2f}, zone {peak.zone}")

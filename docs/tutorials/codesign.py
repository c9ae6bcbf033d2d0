# %% [markdown]
# # Controller and plies together
#
# Gains can only act at the magnets; the plies decide how stiff the shaft is and how much its own damping drives it. The problem `thesis-codesign` frees ten ply angles beside the
# nine numbers of controller and bias. Its search takes minutes, so this page takes the stored optimum and verifies it.

# %%
import tomllib

import numpy as np

import amb_design as ad

problem = ad.load_problem("thesis-codesign")
designs = {
    "as in the thesis": ad.load("thesis-tuned"),
    "controller": ad.load_optimum("thesis-pid"),
    "plies": ad.load_optimum("thesis-codesign", "layup-only"),
    "both": ad.load_optimum("thesis-codesign"),
}
for name, machine in designs.items():
    plies = machine.rotor.shaft.segments[0].plies
    angles = [round(np.degrees(ply.angle)) for ply in plies]
    print(f"{name:17s} {ad.stability_limit(machine).speed_rpm:6.0f} rpm  {angles}")

# %%
ax = ad.plots.machine(designs["both"])

# %% [markdown]
# ## Verify what is stored
#
# The stability limit is not the whole story: sensitivity, damping and control current have limits too. `ad.audit` looks at every one of them on the full model by methods of its own,
# up to the speed that the optimum claims.

# %%
file = ad.packaged()["thesis-codesign"] / "optimum.toml"
stored = tomllib.loads(file.read_text())["optima"]["base"]
found = ad.audit(problem, stored["values"], stored["objective"])
bounds = {c.quantity: c for c in problem.constraints}
for f in found.findings:
    limit = bounds[f.quantity]
    sense = "<=" if limit.kind.upper else ">="
    print(f"{f.quantity:24s} {f.value:8.4g} {sense} {limit.bound:g}")
    assert f.value <= limit.bound if limit.kind.upper else f.value >= limit.bound
reach = found.stability[""]  # of the machine as drawn
print(f"all of this up to {stored['objective'] / ad.rpm(1):.0f} rpm,")
print(f"stable up to {reach.speed_rpm:.0f} rpm, certified: {reach.certified}")

# %% [markdown]
# ## What the plies do
#
# The inner plies, which hardly bend, turned to 45 degrees, where they are stiff in shear; towards the surface they
# turn to the axis, where they stiffen the shaft against bending. The hoop ply at the surface is gone: it carries nothing here, and no limit of this problem asks for hoop strength.

# %%
speeds = ad.rpm(np.linspace(0.0, 22000.0, 89))
compared = {name: designs[name] for name in ("controller", "both")}
diagrams = {name: ad.campbell(m, speeds) for name, m in compared.items()}
limits = {name: ad.stability_limit(m) for name, m in compared.items()}
ax = ad.plots.real_parts(diagrams, limits)

# %% [markdown]
# To search yourself, with two processes (some minutes):
#
# ```
# amb-design optimise thesis-codesign --starts 4 --out codesign
# ```

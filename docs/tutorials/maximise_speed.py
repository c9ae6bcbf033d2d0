# %% [markdown]
# # Maximise the stability limit speed
#
# How fast may the thesis rotor spin if its controller and the bias current are chosen well? The packaged problem `thesis-pid` asks this with limits on sensitivity, damping and
# control current. [Problem files](../problem-files.md) explains how such a question is written.

# %%
import amb_design as ad

problem = ad.load_problem("thesis-pid")
print(problem.question)
for v in problem.variables:
    print(f"  {v.name:34s} {v.lower:9.4g} to {v.upper:9.4g} {v.scale}")
for limit in problem.constraints:
    sense = "at most" if limit.kind.upper else "at least"
    print(f"  {limit.quantity:34s} {sense} {limit.bound:g}")

# %% [markdown]
# One start, from the machine as it is, takes some ten seconds. `starts=8, workers=2` tries seven more in two processes and ranks what they find.

# %%
design = ad.solve(problem, starts=1)
print(f"{design.status}: {design.end / ad.rpm(1):.0f} rpm within all limits")

# %% [markdown]
# "Verified" means that the design was looked at by other methods, on the full model and on a mesh twice as fine, and that its stability limit was proven
# ([optimisation](../optimisation.md)). What holds it back:

# %%
for row in design.limits:
    sense, active = "<=" if row.upper else ">=", "active" if row.active else ""
    print(f"{row.quantity:24s} {row.value:8.4g} {sense} {row.bound:<6g} {active}")

# %%
start = ad.load("thesis-tuned")
machines = {"by hand": start, "optimised": design.machine}
diagrams = {name: ad.campbell(machine) for name, machine in machines.items()}
limits = {name: ad.stability_limit(machine) for name, machine in machines.items()}
axes = ad.plots.campbells(diagrams, limits)

# %% [markdown]
# The search itself: how far the range of speeds reached, and the largest violation, evaluation by evaluation.

# %%
ax = ad.plots.convergence(design)

# %% [markdown]
# The proof of the stability limit travels with the design; `ad.check_proof` checks it without the rest of the package.

# %%
print(f"proven stable up to {design.proof.lower / ad.rpm(1):.0f} rpm")

# %% [markdown]
# # The model in an NLP of your own
#
# The question of the packaged problem `thesis-pid`, asked by hand in CasADi: how fast may this rotor spin if every mode is damped, the sensitivity stays in zone A, and residual
# unbalance asks for no more than half the bias current? The package lends the model and its derivatives; limits and solver are yours.
#
# ## The rotor as Functions
#
# `problem.machine` and `problem.free` give machine and bounds; `ad.closed_loop` makes CasADi Functions of the free numbers.

# %%
import casadi as ca
import numpy as np

import amb_design as ad

problem = ad.load_problem("thesis-pid")  # lends machine, bounds and unbalances
loop = ad.closed_loop(problem.machine, problem.free)
lower, upper, start = np.array(loop.lower), np.array(loop.upper), loop.vector()

# %% [markdown]
# ## The problem
#
# Gains and corner frequencies span decades, so the unknowns are logarithms between the bounds. The end of the range of speeds is an unknown too, and limits hold at seven speeds up to there.

# %%
opti = ca.Opti()
x, level = opti.variable(loop.np), opti.variable()  # from 0 to 1
p = lower * (upper / lower) ** x  # gains and corner frequencies span decades
end = level * problem.top_speed
speeds = end * np.linspace(0.0, 1.0, 7)
peaks = loop.sensitivity_peaks(p, speeds, up_to=2 * np.pi * 10e3)
patterns = [q.amounts for q in problem.patterns]
ratios = loop.unbalance(p, end, patterns, "control_current_ratio", peaks=3)
damping = loop.damping_ratios(p, speeds, window=(6.3, 12566.0))

# %% [markdown]
# Limits are written on lists, the worst few modes or peaks, since the worst one alone has kinks where two change places. `ad.resonance_limit` writes a limit on a resonance peak as
# 1 - 3/peak, which is nearly linear in the damping.

# %%
opti.minimize(-level)
opti.subject_to(opti.bounded(0.0, x, 1.0))
opti.subject_to(opti.bounded(0.02, level, 1.0))
opti.subject_to(loop.growth_rates(p, speeds) / 10.0 <= 0.0)
opti.subject_to(damping / 0.002 >= 1.0)
opti.subject_to(ad.resonance_limit(peaks, 3.0) <= 0.0)
opti.subject_to(ad.resonance_limit(ratios, 0.5) <= 0.0)
opti.set_initial(x, np.log(start / lower) / np.log(upper / lower))
opti.set_initial(level, 0.3)
steps = {"hessian_approximation": "limited-memory", "mu_strategy": "adaptive"}
ends = {"tol": 1e-5, "max_iter": 200, "print_level": 0, "sb": "yes"}
opti.solver("ipopt", {"print_time": False}, steps | ends)
design = opti.solve()
print(f"{design.value(end) * 30 / np.pi:.0f} rpm")

# %% [markdown]
# ## Verify what you find
#
# Eigenvalues and sensitivities were limited at seven speeds, not between them. `ad.audit` looks at every limit of the packaged problem by other methods, on the full model at speeds of its
# own; and the package's own optimiser has a verified optimum to compare with.

# %%
speed = float(design.value(end))
found = ad.audit(problem, loop.values(design.value(p)), speed)
limits = {c.quantity: c for c in problem.constraints}
for f in found.findings:
    limit = limits[f.quantity]
    sense = "<=" if limit.kind.upper else ">="
    print(f"{f.quantity:24s} {f.value:8.4g} {sense} {limit.bound:g}")
    assert (
        f.value <= 1.001 * limit.bound
        if limit.kind.upper
        else f.value >= 0.999 * limit.bound
    )
reach, best = (
    found.stability[""],
    ad.rpm(13957),
)  # of the machine as drawn; the package's own optimum
print(
    f"stable up to {reach.speed_rpm:.0f} rpm, {100.0 * (speed / best - 1.0):+.2f} % from the best known design"
)
assert reach.speed >= speed
assert abs(speed / best - 1.0) < 0.01

# %% [markdown]
# What to know before you rely on such a study stands in [the model in your own study](../studies.md): it is local, several optima exist, and a reduced model is good for the way but not for the end.

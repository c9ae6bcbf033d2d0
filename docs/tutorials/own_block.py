# %% [markdown]
# # Your own controller block, and a limit of your own
#
# A controller that the package does not know, and a requirement that it does not know either. Neither needs a change of the package.
#
# ## A block from python-control
#
# Any linear law can stand where the PID stands: a `StateSpace` holds its matrices, and the hardware around it (sensor gain, low-pass, notches, delay, amplifier) stays. Here a lead
# compensator in the place of the thesis' PID.

# %%
import casadi as ca
import control
import numpy as np

import amb_design as ad
from amb_design.model.magnet import current_stiffness, negative_stiffness

machine = ad.load("thesis-tuned")
pid = machine.controller


def with_law(law):
    """The machine with a law of python-control behind its own hardware."""
    matrices = ad.Matrices(a=law.A, b=law.B, c=law.C, d=law.D)
    block = ad.StateSpace(
        law=matrices,
        sensor_gain=pid.sensor_gain * pid.total_gain,
        low_pass=pid.low_pass,
        notches=pid.notches,
        amplifier=pid.amplifier,
    )
    return ad.replace(machine, {"controller": block})


s = control.tf("s")
lead = control.ss((0.03 * s + 1.0) / (s / (2 * np.pi * 2000.0) + 1.0))
led = with_law(lead)

# %% [markdown]
# Everything works with it as with a PID: certified limit, sensitivities, gradients, proofs, simulation, comparison. (The sensitivity
# rises towards 2 kHz, where the standard stops looking; `highest` looks further.)

# %%
limits = {
    name: ad.stability_limit(m) for name, m in {"PID": machine, "lead": led}.items()
}
for name, limit in limits.items():
    print(f"{name}: {limit.status}, {limit.speed_rpm:.0f} rpm")

# %%
ax = ad.plots.sensitivity(ad.sensitivity(led, ad.rpm(6000)))

# %% [markdown]
# The way back: `to_ss` gives rotor, controllers or closed loop to python-control, with named signals, at any spin speed. Checked here: the loop closed by python-control has the poles
# that the package computes.

# %%
from amb_design.interop.control import to_ss

speed = ad.rpm(6000)
plant, law = to_ss(led, speed, "plant"), to_ss(led, speed, "controller")
poles = control.feedback(plant, law, sign=1).poles()
own = max(mode.eigenvalue.real for mode in ad.spectrum(led, speed))
print(f"largest real part: {poles.real.max():.6f} (python-control), {own:.6f} 1/s")

# %% [markdown]
# ## A limit of your own
#
# How much damping can gain, low-pass and bias current give at speeds up to 8000 rpm? With one demand that no list of quantities knows: the magnets shall stiffen the supports by no more than
# 0.4 N/um, so that the passive bearings keep carrying the rotor.
#
# Specification objects hold symbols as well as numbers, and so do the formulas of the model. A limit is any CasADi expression of them.

# %%
free = {
    "controller.sensor_gain": (1.0, 30.0),
    "controller.low_pass.frequency": (1e3, 1.8e4),
    "magnets.bias_current": (0.2, 0.75),
}
loop = ad.closed_loop(led, free)
lower, upper = np.array(loop.lower), np.array(loop.upper)

opti = ca.Opti()
x, least = opti.variable(loop.np), opti.variable()
p = lower * (upper / lower) ** x
values = dict(zip(loop.names, ca.vertsplit(p), strict=True))
design = ad.replace(led, values)  # a machine that holds symbols
magnet, chain = design.magnets[0], design.controller
gain = chain.sensor_gain * chain.amplifier.gain  # lead and notch have one at rest
static = current_stiffness(magnet) * gain - negative_stiffness(magnet)

speeds = ad.rpm(np.array([0.0, 4000.0, 8000.0]))
peaks = loop.sensitivity_peaks(p, speeds, up_to=2 * np.pi * 10e3)
opti.minimize(-100.0 * least)
opti.subject_to(opti.bounded(0.0, x, 1.0))
opti.subject_to(loop.growth_rates(p, speeds, modes=3) <= 0.0)
opti.subject_to(loop.damping_ratios(p, speeds, window=(6.3, 3000.0)) >= least)
opti.subject_to(ad.resonance_limit(peaks, 3.0) <= 0.0)
opti.subject_to(static / 0.4e6 <= 1.0)  # the limit of our own
opti.set_initial(x, np.log(loop.vector() / lower) / np.log(upper / lower))
steps = {"hessian_approximation": "limited-memory", "tol": 1e-5, "max_iter": 80}
quiet = {"print_level": 0, "sb": "yes"}
opti.solver("ipopt", {"print_time": False}, steps | quiet)
solution = opti.solve()

# %%
found = loop.machine_at(solution.value(p))
for name, value in loop.values(solution.value(p)).items():
    print(f"{name:32s} {value:10.4g}")
print(f"least damping ratio {solution.value(least):.4f}")
print(f"static stiffness {solution.value(static) / 1e6:.3f} N/um")
print(f"stability limit {ad.stability_limit(found).speed_rpm:.0f} rpm")
assert abs(solution.value(static) / 0.4e6 - 1.0) < 1e-3  # it is active

# %% [markdown]
# A limit that belongs into problem files, so that everyone can use it by name, takes an entry in a table, its value with derivatives, and its
# value by another method: [how to extend each stage](../extending.md).

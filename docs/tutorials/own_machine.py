# %% [markdown]
# # Write your own machine file
#
# A machine file is plain data in TOML: numbers in SI or with a unit, every field documented in [machine files](../machine-files.md). `amb-design init FOLDER` writes a commented one
# to start from. Here is one from scratch: a spindle, a carbon tube with a motor in the middle, on two magnetic bearings.

# %%
text = """
format = "amb_design/1"
name = "spindle"
source = { title = "a tutorial" }
operation = { top_speed = "40000 rpm", service_speed = "12000 rpm" }

[materials.carbon]
E1 = "139 GPa"
E2 = "11 GPa"
G12 = "6.05 GPa"
G13 = "6.05 GPa"
G23 = "3.78 GPa"
nu12 = 0.313
density = 1578

[layups.tube]                            # from the inside out
material = "carbon"
angles = ["90 deg", "45 deg", "-45 deg", 0, 0, "45 deg", "-45 deg", "90 deg"]
thickness = "1 mm"

[rotor.shaft]
shear_correction = 0.53
viscous_damping = 6e-6
segments = [{ length = "0.9 m", inner_diameter = "74 mm", layup = "tube" }]

[[rotor.disks]]
name = "motor"
position = "0.45 m"
mass = 5.5
outer_diameter = "110 mm"
inner_diameter = "90 mm"
width = "120 mm"
unbalance = "10 g mm"

[[magnets]]
name = "left"
position = "0.10 m"
turns = 100
pole_area = "4 cm^2"
half_angle = "22.5 deg"
gap = "0.5 mm"
bias_current = 3

[[magnets]]
name = "right"
position = "0.80 m"
turns = 100
pole_area = "4 cm^2"
half_angle = "22.5 deg"
gap = "0.5 mm"
bias_current = 3

[controller]                             # for every magnet and both axes
kp = 12000                               # A/m: neither sensor nor amplifier has a gain
kd = 15
low_pass = { frequency = "3 kHz" }
delay = "50 us"
amplifier = { bandwidth = "2 kHz" }
"""

# %% [markdown]
# Mistakes are answered with what is wrong, where, and what to do:

# %%
import amb_design as ad

try:
    ad.loads(text.replace('gap = "0.5 mm"', 'gap = "0.5 kg"', 1))
except ad.SpecError as error:
    print(error)

# %%
try:
    ad.loads(text.replace("bias_current", "bias_curent", 1))
except ad.SpecError as error:
    print(error)

# %% [markdown]
# The file itself is sound. On the command line, `amb-design check machine.toml` says the same in words.

# %%
machine = ad.loads(text)
ax = ad.plots.machine(machine)

# %%
limit = ad.stability_limit(machine)
print(f"{limit.status}: {limit.speed_rpm:.0f} rpm")
ax = ad.plots.campbell(ad.campbell(machine), limit=limit)

# %% [markdown]
# ## Changing it
#
# Objects are frozen: `ad.replace` gives a new machine with numbers changed by path. A short path changes all numbers that it fits together.

# %%
stronger = ad.replace(machine, {"magnets.bias_current": 4.0, "controller.kd": 25.0})
for each in (machine, stronger):
    found = ad.sensitivity(each)
    print(f"peak sensitivity at rest: {found.worst.value:.2f}, zone {found.zone}")

# %% [markdown]
# The same machine can be made of objects (`ad.Machine`, `ad.Shaft`, `ad.Magnet`, ...); `ad.save` writes any machine as a file that reads back equal.

# %%
assert ad.loads(ad.dumps(machine)) == machine

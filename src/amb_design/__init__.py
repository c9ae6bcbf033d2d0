"""Optimal design and control of flexible, laminated-composite rotors on active magnetic bearings.

>>> import amb_design as ad
>>> machine = ad.load("thesis-tuned")
>>> limit = ad.stability_limit(machine)
>>> print(f"{limit.status}: {limit.speed_rpm:.0f} rpm")
limit found: 9382 rpm

Numbers are in SI everywhere; speeds and frequencies are in rad/s.
"""

from __future__ import annotations

from typing import Any

from .analysis.campbell import Campbell, campbell
from .analysis.critical import CriticalSpeed, critical_speeds
from .analysis.equivalent import Equivalent, equivalent_coefficients
from .analysis.findings import Finding, findings
from .analysis.gradient import critical_speed_gradient, eigenvalue_gradient, stability_gradient
from .analysis.modes import Mode
from .analysis.noise import noise_current
from .analysis.sampled_limit import SampledLimit, SampledStability, sampled_stability, sampled_stability_limit
from .analysis.sensitivity import Sensitivity, SensitivityOverSpeed, sensitivity, sensitivity_over_speed
from .analysis.spectrum import spectrum
from .analysis.stability import Onset, StabilityLimit, stability_limit
from .analysis.system import System, system
from .analysis.unbalance import UnbalanceResponse, unbalance_response
from .errors import AmbDesignError, ModelError, SolveError, SpecError
from .spec.bearing import Bearing, Pin
from .spec.controller import LQG, LQR, PID, Amplifier, LowPass, Matrices, Notch, StateSpace
from .spec.disk import Disk
from .spec.files import dumps, load, load_variants, loads, packaged, save
from .spec.machine import Machine, Operation, Rotor, Sensor
from .spec.magnet import Magnet
from .spec.material import Isotropic, Orthotropic
from .spec.paths import find, numbers, replace
from .spec.problem import DesignProblem
from .spec.problem_files import load_optimum, load_problem, load_problem_variants
from .spec.sampling import Sampling
from .spec.shaft import Ply, Segment, Shaft, layup
from .synthesis.design import ideal, synthesise
from .units import rpm

__version__ = "0.1.0"

__all__ = [
    "LQG",
    "LQR",
    "PID",
    "AmbDesignError",
    "Amplifier",
    "Bearing",
    "Campbell",
    "CriticalSpeed",
    "DesignProblem",
    "Disk",
    "Equivalent",
    "Finding",
    "Isotropic",
    "LowPass",
    "Machine",
    "Magnet",
    "Matrices",
    "Mode",
    "ModelError",
    "Notch",
    "Onset",
    "Operation",
    "Orthotropic",
    "Pin",
    "Ply",
    "Rotor",
    "SampledLimit",
    "SampledStability",
    "Sampling",
    "Segment",
    "Sensitivity",
    "SensitivityOverSpeed",
    "Sensor",
    "Shaft",
    "SolveError",
    "SpecError",
    "StabilityLimit",
    "StateSpace",
    "System",
    "UnbalanceResponse",
    "__version__",
    "campbell",
    "critical_speed_gradient",
    "critical_speeds",
    "dumps",
    "eigenvalue_gradient",
    "equivalent_coefficients",
    "find",
    "findings",
    "ideal",
    "layup",
    "load",
    "load_optimum",
    "load_problem",
    "load_problem_variants",
    "load_variants",
    "loads",
    "noise_current",
    "numbers",
    "packaged",
    "replace",
    "rpm",
    "sampled_stability",
    "sampled_stability_limit",
    "save",
    "sensitivity",
    "sensitivity_over_speed",
    "spectrum",
    "stability_gradient",
    "stability_limit",
    "synthesise",
    "system",
    "unbalance_response",
]


_LATE = {  # what only designs, proofs and simulations need loads with the first of them
    "BaseMotion": "transient.loads",
    "ClosedLoop": "study.loop",
    "BaseShock": "spec.comparison",
    "Comparison": "spec.comparison",
    "Conditions": "spec.comparison",
    "Contact": "transient.loads",
    "Analysis": "analysis.summary",
    "Design": "optimise.design",
    "Family": "optimise.family",
    "Force": "transient.loads",
    "ForceStep": "spec.comparison",
    "Impulse": "transient.loads",
    "Proof": "proof.claims",
    "Shaking": "transient.loads",
    "Transient": "transient.result",
    "analyse": "analysis.summary",
    "audit": "optimise.audit",
    "base_shock": "analysis.disturbance",
    "check_proof": "proof.claims",
    "closed_loop": "study.loop",
    "compare": "comparison.compare",
    "crossing": "optimise.stable_speed",
    "force_step": "analysis.disturbance",
    "largest_stable": "optimise.stable_speed",
    "load_comparison": "spec.comparison_files",
    "load_transient": "transient.result",
    "margins": "analysis.margins",
    "minimise_abscissa": "optimise.abscissa",
    "open_loop": "study.loop",
    "pareto": "optimise.answers",
    "prove_stability_limit": "proof.claims",
    "relaxations": "optimise.answers",
    "resonance_limit": "study.quantities",
    "save_report": "report.save",
    "simulate": "transient.simulate",
    "solve": "optimise.solve",
}


def __getattr__(name: str) -> Any:
    import importlib

    if name in ("interop", "plots"):  # matplotlib and other packages load only when they are used
        return importlib.import_module(f".{name}", __name__)
    if name in _LATE:
        return getattr(importlib.import_module(f".{_LATE[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

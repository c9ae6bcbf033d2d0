"""Exports of a machine for the command line: each is one call of a bridge."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import SpecError
from ..spec.machine import Machine
from ..spec.sampling import Sampling

TARGETS = ("c", "control", "fmu", "mat", "ross")


def export(machine: Machine, to: str, folder: Path, speed: float, sampling: Sampling, modes: int) -> list[str]:
    """Write a machine for another program.

    Parameters
    ----------
    machine : Machine
    to : {"c", "control", "fmu", "mat", "ross"}
        Sampled controllers and equations of motion as C; state space as NumPy archives, or as a MATLAB file; units of FMI 3.0; a rotor file
        of ROSS.
    folder : Path
        Where the files go.
    speed : float
        Spin speed [rad/s] of state spaces and controllers, and the first one of the unit.
    sampling : Sampling
        Of controllers.
    modes : int
        Lowest modes that are kept, in each plane.

    Returns
    -------
    list of str
        Names of the files.

    Raises
    ------
    SpecError
        If there is no such target.
    """
    if to not in TARGETS:
        raise SpecError("is no target", field="--to", got=to, remedy="choose one of " + ", ".join(TARGETS))
    before = set(os.listdir(folder))
    if to == "c":
        _c(machine, folder, speed, sampling, modes)
    elif to == "fmu":
        from ..interop.fmu import controller_fmu, model_fmu

        model_fmu(machine, folder / "model.fmu", speed, modes)
        if _has_controller(machine):
            controller_fmu(machine, folder / "controller.fmu", sampling, speed)
    elif to == "ross":
        from ..interop.ross import save_ross

        save_ross(machine, folder / "rotor.toml", elements=2)
    else:
        _state_spaces(machine, folder, to, speed, modes)
    return sorted(set(os.listdir(folder)) - before)


def _c(machine: Machine, folder: Path, speed: float, sampling: Sampling, modes: int) -> None:
    from ..interop.ccode import controller_code, function_code
    from ..study.loop import closed_loop

    loop = closed_loop(machine)
    function_code([loop.function("rhs", modes=modes), loop.function("loads", modes=modes)], folder, "model")
    if _has_controller(machine):
        controller_code(machine, folder, sampling, speed)


def _state_spaces(machine: Machine, folder: Path, to: str, speed: float, modes: int) -> None:
    import numpy as np

    from ..interop.control import PARTS, to_ss
    from ..interop.results import save_mat

    for part in PARTS if _has_controller(machine) else ("plant",):
        s = to_ss(machine, speed, part, modes)
        matrices = {"A": s.A, "B": s.B, "C": s.C, "D": s.D, "speed": np.array([speed])}
        names = {
            "inputs": np.array(s.input_labels),
            "outputs": np.array(s.output_labels),
            "states": np.array(s.state_labels),
        }
        if to == "mat":
            save_mat({**matrices, **names}, folder / f"{part}.mat")
        else:
            np.savez(folder / f"{part}.npz", allow_pickle=False, **matrices, **names)


def _has_controller(machine: Machine) -> bool:
    return any(law is not None for m in machine.magnets for law in machine.controllers_of(m))

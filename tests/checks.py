"""Comparison of computed with expected numbers, with the worst error printed beside its tolerance (``pytest -rP``)."""

from __future__ import annotations

from typing import Any

import numpy as np


def within(computed: Any, expected: Any, tolerance: float, what: str) -> float:
    """Assert that numbers agree relative to the expected ones; returns the worst relative error."""
    computed, expected = np.asarray(computed), np.asarray(expected)
    assert computed.shape == expected.shape, f"{what}: {computed.shape} numbers for {expected.shape} expected ones"
    assert computed.size, f"{what}: nothing to compare"
    error = float(np.max(np.abs(computed - expected) / np.abs(expected)))
    print(f"{what}: {error:.2e} (tolerance {tolerance:g})")
    assert error <= tolerance, f"{what}: off by {error:.3e}, tolerance {tolerance:g}\n{computed}\n{expected}"
    return error


def within_absolute(computed: Any, expected: Any, tolerance: float, what: str) -> float:
    """Assert that numbers agree absolutely; returns the worst error."""
    computed, expected = np.asarray(computed), np.asarray(expected)
    assert computed.shape == expected.shape, f"{what}: {computed.shape} numbers for {expected.shape} expected ones"
    assert computed.size, f"{what}: nothing to compare"
    error = float(np.max(np.abs(computed - expected)))
    print(f"{what}: {error:.2e} absolute (tolerance {tolerance:g})")
    assert error <= tolerance, f"{what}: off by {error:.3e}, tolerance {tolerance:g}\n{computed}\n{expected}"
    return error

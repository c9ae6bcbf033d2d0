"""Nonlinear motion in time: run-ups, lift-off, touch-down, saturation, sampled controllers."""

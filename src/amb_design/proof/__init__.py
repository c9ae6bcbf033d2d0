"""Certificates of stability, and a checker that needs nothing of the rest."""

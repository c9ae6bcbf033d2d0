"""Designs side by side: one set of conditions, one table, the better entry of each line marked."""

"""Results on a terminal, and files for other programs: one module for each command."""

"""Design optimisation: from a problem to a verified optimum."""

"""Every quantity of a design problem, as values with exact derivatives."""

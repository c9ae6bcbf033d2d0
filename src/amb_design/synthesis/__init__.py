"""Controllers from what they shall achieve: reduction of the rotor, quadratic regulators and observers."""

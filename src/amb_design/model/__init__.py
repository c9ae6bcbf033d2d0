"""The rotor and its controller as CasADi expressions; the same functions take numbers and symbols."""

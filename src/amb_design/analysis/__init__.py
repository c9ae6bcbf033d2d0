"""Numbers from the model: spectra, stability limits, responses, and their derivatives."""

"""Linearisation at an operating point, and what follows from it: modes, responses, gains, realisations."""

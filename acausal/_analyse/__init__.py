"""Linearisation at an operating point, and its analysis: modes, responses, gains, realisations."""

"""Time integration: from the functions of a system to trajectories."""

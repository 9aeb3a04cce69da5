"""From functions to trajectories."""

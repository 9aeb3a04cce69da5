"""Event location within a step, and event iteration at an instant."""

"""Events within a step, and the event iteration at an instant."""

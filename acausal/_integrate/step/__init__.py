"""One step, its dense output and its derivatives."""

"""Unit check: the dimensions of the equations of a model, and contradictions between their terms."""

"""First and second derivatives of results with respect to parameters."""

"""Statement of a problem: free parameters, limits, distributions and units, read and checked."""

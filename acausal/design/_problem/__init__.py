"""What a user states: free parameters, limits, distributions and units, read and checked."""

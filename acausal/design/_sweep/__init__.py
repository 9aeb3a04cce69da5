"""Batches of members: grids, lists and samples of parameters, in memory or in a store."""

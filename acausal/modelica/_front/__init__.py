"""From Modelica text to the flat model, by rumoca: it parses, instantiates, checks types and flattens.

rumoca also compiles a flat model for its own solvers, and refuses those that they cannot run. `equations.py`,
`functions.py` and `patches.py` keep from it what it need not see. `loops.py` and `outer_values.py` supply equations and
values that it ignores.
"""

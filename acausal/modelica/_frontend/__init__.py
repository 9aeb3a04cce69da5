"""A front end for Modelica, by the specification (Modelica 3.6): from texts to the flat model of `_syntax/flat.py`.

Modules are named by the chapters that they implement.
"""

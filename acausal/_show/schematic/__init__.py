"""Schematics: components as symbols, laid out in columns, with orthogonal lines between their ports."""

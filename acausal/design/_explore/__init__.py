"""Designs explored by hand: results, curves and gradients at the values of sliders."""

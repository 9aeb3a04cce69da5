"""The documentation: pages with executed Python blocks, their outputs and pictures."""

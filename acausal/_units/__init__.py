"""Numbers with units: dimensions, unit strings, and quantities in SI units."""

"""An example of each component and record of the library, with values of a real part, as its card shows it."""

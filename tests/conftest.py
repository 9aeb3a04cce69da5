"""What all tests share."""

import gc

# Compiling leaves millions of objects that stay, and the collector would walk them all again and again.
gc.set_threshold(100_000, 50, 1000)

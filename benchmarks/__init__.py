"""Speed of the library, compared with hand-written equations, CasADi with CVODES, and fixed limits.

`python -m benchmarks --json FILE [--out DIR] [--only NAME ...]` runs them. Each module without an underscore is one.
"""

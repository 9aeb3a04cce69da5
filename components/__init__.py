"""Physical components, one sub-package for each domain.

Everywhere: SI units; a flow variable (`i`, `tau`, `f`, `q`) is positive into the component; effort times flow is power
into the component.
"""

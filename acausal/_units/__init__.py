"""Units: what dimension an equation has, whether its terms agree, and parameters given with a unit."""

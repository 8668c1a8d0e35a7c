"""A whole gearbox: shafts on bearings in a casing, and the gear stages between them."""

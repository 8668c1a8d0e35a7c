"""Static solution and stresses of any planetary set: transmission error, load sharing, stiffness."""

"""Housing: from the carrier frame to a fixed sensor, and what its order spectrum tells."""

"""Motion in time: fixed and adaptive steps, the map of one period, sections and sweeps."""

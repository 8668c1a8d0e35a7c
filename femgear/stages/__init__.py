"""What several trains run: the protocol of a stage, the static solution, the lumped set."""

"""A set in a fixed housing, both ways: the structure, the response in it, in orders of the carrier."""

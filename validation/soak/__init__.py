"""Soak tests: hostile and damaged input, killed processes and failing systems, for as long as one likes.

A kind is a module with ``trial(number, folder) -> Outcome``: the number alone decides what is tried, and
``python validation/soak KIND NUMBER`` repeats it. The short forms in `test_soak.py` run some numbers of every
kind, ``make soak`` goes on from the last one; `state` keeps what came out and `page` writes
docs/reliability.md.
"""

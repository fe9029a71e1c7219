"""Example controllers to copy, one file each: ``python -m palmares.examples.balls_softhand --help``."""

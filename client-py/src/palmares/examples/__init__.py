"""Controllers to be copied, each a file of its own: ``python -m palmares.examples.balls_softhand --help``."""

"""Ratings of the shipped controllers on all problems."""

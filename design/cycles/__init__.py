"""Limit cycles: branches of them, Hopf points, maps of where it hunts, and what simulation says."""

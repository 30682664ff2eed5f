"""Stability of steady running: critical speeds, modes, loci, boxes of vehicles."""

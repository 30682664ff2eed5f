"""Wheel-rail contact: laws, profiles and their contact, conicity, wear, Hertz and Kalker, FASTSIM."""

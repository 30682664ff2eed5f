"""Wheel-rail contact: laws, profiles, Hertz and Kalker, conicity."""

"""Limit cycles: their branches, Hopf points, maps of hunting, and simulations."""

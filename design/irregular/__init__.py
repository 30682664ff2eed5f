"""Irregular motion: Lyapunov exponents, Poincare sections and their bifurcation diagrams."""

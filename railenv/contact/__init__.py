"""Contact of wheel and rail: Hertz, Kalker's coefficients, FASTSIM, and creep laws beside it."""

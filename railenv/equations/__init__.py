"""The equations of motion, written once as plain Python functions of scalars.

They read like the paper, run on floats, complex numbers and SymPy symbols alike, and are what every
kernel, Jacobian and linear model of the package is generated from. The corrections of the print are
argued in ``docs/physics.md``.
"""

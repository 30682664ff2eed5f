"""Compiled kernels: generated from the equations, joined with hand-written integrators, cached.

``bogie.py``, ``dual_wheelset.py`` and ``cooperrider.py`` are generated (``make kernels``) and are texts
to be compiled, not modules to be imported.
"""

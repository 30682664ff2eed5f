"""Which reading of the paper's print gives the paper's numbers? ``python -m benchmarks.readings.run``.

The equations are written out here a second time, from the print, with its misprints to be switched on
one by one. They share nothing with those of the package but the functions of numbers.
"""

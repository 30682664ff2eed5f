"""Tuning of controllers on families of linear plants."""

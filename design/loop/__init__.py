"""Closed loops with sampled controllers: their interface, the map over a period, margins."""

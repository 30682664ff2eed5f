"""Closed loops with sampled controllers: what a controller is, the map over a period, margins."""

"""Wheel-rail contact: profiles, the contact of a pair of them, equivalent conicity, wear."""

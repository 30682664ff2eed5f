"""Tests of vehicles and the elements that they are assembled from."""

"""Gymnasium environments of hunting vehicles."""

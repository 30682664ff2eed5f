"""Kernels: traced when a structure is first used, completed by texts, compiled, and cached."""

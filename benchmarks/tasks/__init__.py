"""What classical controllers earn in the registered tasks."""

"""What reinforcement learning reaches in the registered tasks, with the shipped recipes."""

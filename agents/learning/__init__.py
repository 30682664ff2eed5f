"""Learning: training on Stable-Baselines3, policy search, recipes, adapters."""

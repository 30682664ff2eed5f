"""RL clients that people bring, each in an environment of its own; see docs/clients.md."""

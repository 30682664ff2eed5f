"""Where steady running is stable: critical speeds, modes, loci, boxes of vehicles."""

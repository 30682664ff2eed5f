"""What training through the simulator reaches in robust critical speed, from random weights."""

"""Train a policy against hunting beyond the critical speed, then see what it is worth."""

import sys

import agents
import design
import railenv

steps = int(sys.argv[1]) if len(sys.argv) > 1 else None  # None: those of the recipe
training = agents.train("ppo", "railenv/BogieSensors-v1", total_timesteps=steps, seed=0, progress=True)
training.policy.save("policy.npz")

vehicle = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "secondary")
print(training)
print("without control:", design.critical_speed(vehicle))
print("with the policy:", design.critical_speed(vehicle, controller=training.policy))

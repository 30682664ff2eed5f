"""Bring a controller of your own: a class with two methods, evaluated like the shipped ones."""

import dataclasses
import math

import agents
import railenv


class Damper(agents.Controller):
    """Moment against the frame's yaw rate, whose mean is taken out."""

    def reset(self, count=None):
        """Start anew."""
        self.mean = 0.0

    def act(self, observation):
        """Return the commanded moment as a share of 26 kN m."""
        yaw_rate = 0.2 * observation[..., 1]  # the observation's scale is 0.2 rad/s
        self.mean = self.mean + 0.005 * (yaw_rate - self.mean)
        return (-1e5 / 26e3 * (yaw_rate - self.mean))[..., None]


def main(plan=None):
    """Evaluate it on the coach."""
    coach = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    return agents.evaluate(Damper(), coach, plan=plan)


if __name__ == "__main__":
    tangent = dataclasses.replace(agents.Plan.quick(), curves=((math.inf, 0.0),), delays=())
    print(main(tangent))

"""A pendulum on a cart learns to swing up: a task of one's own in Python."""

import math

import treeroll


class Pendulum(treeroll.Task):
    # Columns of record() below that the policy acts on and gives.
    trace_inputs = ["time_s"]
    trace_outputs = ["cart_acceleration_mps2"]

    def __init__(self, settings):
        self.length_m = settings.number("length_m", 0.3, above=0)
        self.friction_radps = settings.number("friction_radps", 0.05, least=0)
        self.step_s = settings.number("step_s", 0.005, above=0, most=0.1)
        self.duration_s = settings.number("duration_s", 2.5, above=0, most=60)

    def describe(self):
        return treeroll.Description(input_dim=1, output_dim=1, time_limit_s=10)

    def evaluate(self, policy, seed):
        angle_rad, rate_radps = -math.pi, 0.0  # hanging; 0 is upright
        cart_m, cart_mps = 0.0, 0.0
        least = math.inf
        for k in range(round(self.duration_s / self.step_s)):
            time_s = k * self.step_s
            acceleration_mps2 = policy(time_s)
            cost = (angle_rad / math.pi) ** 2 + rate_radps**2 / 50 + cart_m**4
            least = min(least, cost)
            self.record(
                time_s=time_s, angle_rad=angle_rad, cart_m=cart_m,
                cart_acceleration_mps2=acceleration_mps2, cost=cost,
                pose=[[cart_m, 0, cart_m - self.length_m * math.sin(angle_rad),
                       self.length_m * math.cos(angle_rad)]])
            torque = 9.81 * math.sin(angle_rad) + acceleration_mps2 * math.cos(angle_rad)
            rate_radps += self.step_s * (torque / self.length_m - self.friction_radps * rate_radps)
            angle_rad += self.step_s * rate_radps
            cart_mps += self.step_s * acceleration_mps2
            cart_m += self.step_s * cart_mps
            if abs(cart_m) > 10:
                raise treeroll.Failed(f"the cart is {cart_m:.1f} m away")
        self.terms["least_cost"] = least
        return math.exp(-least)


if __name__ == "__main__":
    treeroll.run(Pendulum)

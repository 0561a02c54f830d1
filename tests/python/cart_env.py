"""A small environment with Gymnasium's interface: a cart is to stand at 0. And the task of it."""

import types

import treeroll
from treeroll.gymnasium_task import GymnasiumTask


class CartEnv:
    observation_space = types.SimpleNamespace(shape=(2,))
    action_space = types.SimpleNamespace(shape=(1,))

    def reset(self, *, seed=None, options=None):
        self.state, self.steps = [1.0 + (seed % 100) / 1000, 0.0], 0
        return list(self.state), {}

    def step(self, action):
        x, v = self.state
        v += 0.1 * float(action[0])
        x += 0.1 * v
        self.state, self.steps = [x, v], self.steps + 1
        return list(self.state), -(x * x), abs(x) > 5, self.steps == 40, {}


class Cart(GymnasiumTask):
    def make(self, settings):
        settings.number("unused", 1.0)
        return CartEnv()

    def reward_of(self, total):
        return 1 / (1 - total)


if __name__ == "__main__":
    treeroll.run(Cart)

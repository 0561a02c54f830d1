"""Environments of the Gymnasium interface as tasks."""

from .policy import Policy
from .settings import Refused, Settings
from .task import Description, Task


class GymnasiumTask(Task):
    """Its policy takes an observation and gives an action. Derive from it: make(), reward_of()."""

    time_limit_s = 60.0
    deterministic = False

    def __init__(self, settings: Settings):
        self.environment = self.make(settings)

    def make(self, settings: Settings) -> object:
        """The environment: ``gymnasium.make("Pendulum-v1", max_episode_steps=200)``."""
        raise NotImplementedError

    def reward_of(self, total: float) -> float:
        """The task's reward, from 0 to 1, of the sum of an episode's rewards."""
        raise NotImplementedError

    def describe(self) -> Description:
        spaces = self.environment.observation_space, self.environment.action_space
        if any(len(space.shape or ()) != 1 for space in spaces):
            raise Refused("name", "must observe and act by lists of numbers (Box)")
        sizes = [int(space.shape[0]) for space in spaces]
        return Description(*sizes, self.time_limit_s, deterministic=self.deterministic)

    def evaluate(self, policy: Policy, seed: int) -> float:
        observation, _ = self.environment.reset(seed=seed % 2**31)
        total, ended = 0.0, False
        while not ended:
            action = policy.act(list(observation))
            observation, reward, terminated, truncated, _ = self.environment.step(action)
            total, ended = total + float(reward), terminated or truncated
        return self.reward_of(total)

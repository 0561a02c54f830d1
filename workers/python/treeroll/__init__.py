"""treeroll for programs in Python: tasks, policies, and what a study has learnt so far.

A task is a class, and one line makes its file a program that a worker runs
(``treeroll-worker --evaluator 'python3 reach.py'``)::

    import treeroll

    class Reach(treeroll.Task):
        def __init__(self, settings):
            self.goal_m = settings.number("goal_m", 0.5, above=0)

        def describe(self):
            return treeroll.Description(input_dim=1, output_dim=1, time_limit_s=1)

        def evaluate(self, policy, seed):
            miss_m = policy(1.0) - self.goal_m
            return 1 / (1 + miss_m**2)

    if __name__ == "__main__":
        treeroll.run(Reach)

A robot's task is :func:`with_operator`: nothing moves, and nothing counts, before a person has said so.
A policy that was learnt acts on a robot (:class:`Policy`), and a :class:`Watcher` gives the best one
while a study is still learnt. Nothing is needed but Python 3.9 and ``libtreeroll_policy.so``.
"""

from .operated import with_operator
from .policy import Policy, PolicyError
from .program import run
from .settings import Refused, Settings
from .task import Description, Discarded, Failed, Task, Trial
from .watcher import BestPolicy, Watcher

__all__ = ["BestPolicy", "Description", "Discarded", "Failed", "Policy", "PolicyError", "Refused",
           "Settings", "Task", "Trial", "Watcher", "run", "with_operator"]

"""Acts with a policy that was learnt."""

import sys

import treeroll

policy = treeroll.Policy.load(sys.argv[1])
policy.start()
for k in range(5):
    print(f"at {k * 0.5} s: {policy(k * 0.5):.3f} m/s^2")

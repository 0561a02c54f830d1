"""A task that prints wherever it can, as a library below it might, and reads what is not its own."""

import os
import sys

import treeroll


class Prints(treeroll.Task):
    def describe(self):
        return treeroll.Description(1, 1, 10)

    def evaluate(self, policy, seed):
        print('{"reward": 7}')
        os.write(1, b'{"reward": 8}\n')
        os.system('echo \'{"reward": 9}\'')
        assert sys.stdin.read() == "" and os.read(0, 10) == b""
        return 0.5


if __name__ == "__main__":
    treeroll.run(Prints)

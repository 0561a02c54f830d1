import copy
import dataclasses
import json
import math
import pickle
import threading
import unittest

from support import policy_text
from treeroll import Policy, PolicyError


class PolicyTest(unittest.TestCase):
    def test_acts(self):
        policy = Policy(policy_text())
        self.assertEqual((policy.input_dim, policy.output_dim, policy.theta_dim), (1, 1, 2))
        policy.start()
        self.assertEqual(policy(0.5), 0.25)
        self.assertEqual(policy.act([1.5]), [0.75])
        self.assertEqual(policy.act((1.5,)), [0.75])

    def test_acts_on_several_numbers(self):
        policy = Policy(json.loads(policy_text(inputs=2, outputs=3)))
        self.assertEqual(len(policy.act([0.5, 0.5])), 3)
        with self.assertRaisesRegex(PolicyError, "use act"):
            policy(1.0)

    def test_acts_by_name(self):
        plain = Policy(policy_text(inputs=2, outputs=1))
        self.assertEqual((plain.input_names, plain.output_names), ([], []))
        with self.assertRaisesRegex(PolicyError, "names no inputs and outputs: use act"):
            plain.act_named({"angle_rad": 1.0, "rate_radps": 2.0})
        names = {"inputs": ["angle_rad", "rate_radps"], "outputs": ["torque_nm"]}
        policy = Policy({**json.loads(plain.text), "signals": names})
        self.assertEqual((policy.input_names, policy.output_names), tuple(names.values()))
        given = policy.act([1.0, 2.0])
        self.assertNotEqual(given, policy.act([2.0, 1.0]))
        self.assertEqual(policy.act_named({"rate_radps": 2.0, "angle_rad": 1.0}), {"torque_nm": given[0]})
        for inputs in ({"angle_rad": 1.0}, {"angle_rad": 1.0, "rate_radps": 2.0, "time_s": 0.0},
                       {"angle_rad": 1.0, "rate_dps": 2.0}, {}):
            with self.assertRaisesRegex(PolicyError, "must be angle_rad, rate_radps"):
                policy.act_named(inputs)
        with self.assertRaisesRegex(PolicyError, "finite"):
            policy.act_named({"angle_rad": 1.0, "rate_radps": math.nan})
        self.assertEqual(json.loads(policy.text)["signals"], names)
        with self.assertRaisesRegex(PolicyError, "each name must be there once"):
            Policy({**json.loads(plain.text), "signals": {**names, "inputs": ["q", "q"]}})

    def test_theta_changes_what_it_does(self):
        policy = Policy(policy_text())
        self.assertEqual(policy.theta, [0.5, 0.25])
        policy.theta = [0.5, 1.0]
        self.assertEqual(policy(0.5), 1.0)
        self.assertEqual(Policy(policy.text).theta, [0.5, 1.0])
        with self.assertRaisesRegex(PolicyError, "3 numbers, must have 2"):
            policy.theta = [1, 2, 3]
        with self.assertRaisesRegex(PolicyError, "finite"):
            policy.theta = [math.inf, 2]
        self.assertEqual(policy.theta, [0.5, 1.0])

    def test_a_copy_is_a_policy_of_its_own(self):
        @dataclasses.dataclass
        class Robot:
            policy: Policy

        policy = Policy(policy_text())
        policy.theta = [0.5, 0.1]
        for copied in (copy.copy(policy), copy.deepcopy([policy])[0], pickle.loads(pickle.dumps(policy)),
                       dataclasses.asdict(Robot(policy))["policy"]):
            self.assertEqual(copied.text, policy.text)
            copied.theta = [0.5, 1.0]
            del copied  # frees what is its own, and no more
            self.assertEqual(policy(0.5), 0.1)

    def test_refuses_what_it_cannot_take(self):
        for text in ("", "{}", "[]", "nonsense", b"\xff", "a\0b", policy_text()[:-5]):
            with self.assertRaises(PolicyError, msg=repr(text)):
                Policy(text)
        policy = Policy(policy_text())
        for numbers in ([], [1, 2], [math.nan]):
            with self.assertRaises(PolicyError, msg=repr(numbers)):
                policy.act(numbers)

    def test_obeys_the_bounds_of_its_text(self):
        bounds = {"outside": "clip", "theta_min": [], "theta_max": [2.0], "output_min": [],
                  "output_max": [0.5], "output_rate_max": [1.0], "sample_time_s": 0.1,
                  "output_start": [0.0]}
        text = json.loads(policy_text())
        policy = Policy({**text, "bounds": bounds})
        policy.start()
        self.assertEqual([policy(9) for _ in range(6)], [0.1, 0.2, 0.1 + 0.2, 0.1 + 0.2 + 0.1, 0.5, 0.5])
        policy.theta = [0.5, 9.0]
        self.assertEqual(policy.theta, [0.5, 2.0])
        self.assertEqual(json.loads(policy.text)["bounds"], bounds)
        policy.theta = [0.5, -5.0]  # taken over while the robot moves
        self.assertEqual([policy(0.5), policy(0.5)], [0.5 - 0.1, 0.5 - 0.1 - 0.1])

        refusing = Policy({**text, "bounds": {**bounds, "outside": "refuse", "output_rate_max": [],
                                              "sample_time_s": 0.0, "output_start": []}})
        refusing.start()
        self.assertEqual(refusing(0.5), 0.25)
        with self.assertRaisesRegex(PolicyError, "output 1 is 4.5, must be at most 0.5"):
            refusing(9)
        with self.assertRaisesRegex(PolicyError, "element 2 of theta is 9, must be at most 2"):
            refusing.theta = [0.5, 9.0]
        self.assertEqual(refusing.theta, [0.5, 0.25])

    def test_each_thread_hears_of_its_own_error(self):
        said = []

        def fail(size):
            try:
                Policy(policy_text()).theta = [0.0] * size
            except PolicyError as error:
                said.append((size, str(error)))

        threads = [threading.Thread(target=fail, args=(size,)) for size in range(3, 30)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for size, text in said:
            self.assertIn(f"{size} numbers", text)
        self.assertEqual(len(said), 27)

    def test_takes_arrays(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed: arrays are not tried")
        policy = Policy(policy_text())
        policy.theta = numpy.array([0.5, 1.0])
        self.assertEqual(policy.act(numpy.array([0.5])), [1.0])

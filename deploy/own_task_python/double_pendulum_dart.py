"""The swing-up of the double pendulum on a cart (thesis, appendix B) in DART instead of ODE: the same
settings, cost and reward as the task `swing_up`. Needs python3-dartpy and python3-numpy.

DART steps to first order, and less exactly than ODE: at 0.1 ms its rewards differ by about .01 from those
of the equations of motion, at 1 ms by up to .07 (ODE at 1 ms: .006)."""

import math

import dartpy
import numpy as np

import treeroll

# Lengths in m, masses in kg, inertias about the centres of gravity in kg m^2, friction in N m s.
LENGTHS_M = (0.323, 0.480)
CENTRES_M = (0.2145, 0.223)  # from the joint
MASSES_KG = (0.853, 0.510)
INERTIAS_KGM2 = (0.0126, 0.0185)
FRICTION_NMS = 0.005
ALPHA = 0.25


class SwingUp(treeroll.Task):
    name = "swing_up"
    trace_inputs = ["time_s"]
    trace_outputs = ["cart_acceleration_mps2"]

    def __init__(self, settings):
        settings.string("plant", "dart", words=["dart"])
        self.step_s = settings.number("step_s", 0.0002, above=0, most=0.1)
        self.duration_s = settings.number("duration_s", 2.5, above=0, most=60)
        self.world = dartpy.simulation.World()
        self.world.setGravity([0, -9.81, 0])
        self.world.setTimeStep(self.step_s)
        self.pendulum = self.build()
        self.world.addSkeleton(self.pendulum)

    @staticmethod
    def build():
        """A cart that is moved as the policy says, and two links on hinges about z."""
        skeleton = dartpy.dynamics.Skeleton("double pendulum on a cart")
        track, cart = skeleton.createPrismaticJointAndBodyNodePair()
        track.setAxis([1, 0, 0])
        track.setActuatorType(dartpy.dynamics.Joint.ACCELERATION)
        parent, foot_m = cart, 0.0
        for length_m, centre_m, mass_kg, inertia in zip(LENGTHS_M, CENTRES_M, MASSES_KG,
                                                        INERTIAS_KGM2):
            hinge, link = skeleton.createRevoluteJointAndBodyNodePair(parent)
            hinge.setAxis([0, 0, 1])
            place = dartpy.math.Isometry3()
            place.set_translation([0, foot_m, 0])
            hinge.setTransformFromParentBodyNode(place)
            hinge.setDampingCoefficient(0, FRICTION_NMS)
            link.setInertia(dartpy.dynamics.Inertia(mass_kg, [0, centre_m, 0],
                                                    np.eye(3) * inertia))
            parent, foot_m = link, length_m
        return skeleton

    def describe(self):
        return treeroll.Description(input_dim=1, output_dim=1, time_limit_s=30)

    def evaluate(self, policy, seed):
        self.world.reset()
        # DART counts the second angle from the first link.
        self.pendulum.setPositions([0, -math.pi, 0])
        self.pendulum.setVelocities([0, 0, 0])
        least = math.inf
        for k in range(round(self.duration_s / self.step_s) + 1):
            time_s = k * self.step_s
            y, phi1, relative = self.pendulum.getPositions()
            y_rate, phi1_rate, relative_rate = self.pendulum.getVelocities()
            phi2, phi2_rate = phi1 + relative, phi1_rate + relative_rate
            cost = (5 / math.pi**2 * (phi1**2 + phi2**2) + (0.7 * y) ** 4
                    + (phi1_rate**2 + phi2_rate**2 + y_rate**2) / 50)
            least = min(least, cost)
            acceleration_mps2 = policy(time_s + self.step_s / 2)
            self.record(time_s=time_s, phi1_rad=phi1, phi2_rad=phi2, y_m=y,
                        cart_acceleration_mps2=acceleration_mps2, cost=cost)
            self.pendulum.setCommand(0, acceleration_mps2)
            self.world.step()
        if not math.isfinite(least):
            raise treeroll.Failed("the simulation has diverged")
        return math.exp(-ALPHA * least)


if __name__ == "__main__":
    treeroll.run(SwingUp)

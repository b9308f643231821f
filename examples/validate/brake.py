"""The two-disk brake as a reader of the paper would write it down, for the examples beside this file.

The state is (u, u', v, v', theta'): rotor twist u = theta - phi_2, stator twist v = phi_1, rotor speed. Parameters and
the state to start from come from a result of `stickslip run`; the runs begin at the kick, a few milliseconds before
the stick-slip, so that they take seconds.
"""

import json

import h5py
import numpy as np


class Brake:
    """Parameters in SI, as the result file holds them, and the start: the state just after the kick."""

    def __init__(self, path):
        with h5py.File(path) as file:
            text = file["input/resolved"][()].decode()
            events = file["events"]
            names = events["kind"].attrs["flag_meanings"].split()
            kick = [names[kind] for kind in events["kind"]].index("kick")
            self.start = float(events["time"][kick])
            at_kick = ["rotor_twist", "rotor_twist_rate", "phi1", "phi1_dot", "theta_dot"]
            self.state = np.array([events[f"{name}_after"][kick] for name in at_kick])
            before = np.array([events[f"{name}_before"][kick] for name in at_kick])
            self.unkicked = before
            self.theta = float(events["theta_after"][kick])
            self.phi2 = float(events["phi2_after"][kick])
            # The axial motion has long come to rest: the contact force is the actuating force.
            self.normal_force = float(file["trajectory/normal_force"][-1])
            self.stop = 6.99
        values = {}
        section = ""
        for line in text.splitlines():
            line = line.split("#")[0].strip()
            if line.startswith("["):
                section = line.strip("[]")
            elif "=" in line:
                key, value = (part.strip() for part in line.split("=", 1))
                try:
                    values[f"{section}.{key}"] = json.loads(value)
                except json.JSONDecodeError:
                    pass
        self.inertia = values["torsion.rotor_inertia"]
        self.surface = values["torsion.surface_inertia"]
        self.stiffness = values["torsion.stiffness"]
        self.damping = values["torsion.damping"]
        self.radius = values["contact.radius"]
        self.breakaway = values["friction.breakaway"]
        self.low = values["friction.low_speed"]
        self.high = values["friction.high_speed"]
        self.decay = values["friction.decay"]

    def torques(self, y):
        """T_r and T_s."""
        return (self.damping * y[1] + self.stiffness * y[0], self.damping * y[3] + self.stiffness * y[2])

    def transmitted(self, y):
        """T_f = (T_r + T_s)/2, what the interface carries in stick."""
        return sum(self.torques(y)) / 2

    def limit(self):
        """mu_0 r F_n."""
        return self.breakaway * self.radius * self.normal_force

    def relative_velocity(self, y):
        """omega_r = phi_2' - phi_1'."""
        return y[4] - y[1] - y[3]

    def slip(self, sense):
        """The right-hand side of slip with this sense, equations (2) and (3)."""

        def rates(_, y):
            rotor, stator = self.torques(y)
            w = sense * self.relative_velocity(y)
            mu = self.high + (self.low - self.high) * np.exp(-self.decay * w)
            friction = sense * mu * self.radius * self.normal_force
            theta = -rotor / self.inertia
            v = (friction - stator) / self.surface
            return np.array([y[1], theta - (rotor - friction) / self.surface, y[3], v, theta])

        return rates

    def stick(self, _, y):
        """The right-hand side of stick, equation (4)."""
        rotor, stator = self.torques(y)
        phi = (rotor - stator) / (2 * self.surface)
        theta = -rotor / self.inertia
        return np.array([y[1], theta - phi, y[3], phi, theta])

    def joined(self, y):
        """Both surfaces at their mean speed."""
        y = y.copy()
        half = self.relative_velocity(y) / 2
        y[1] += half
        y[3] += half
        return y

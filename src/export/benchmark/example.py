"""Repeats the stick-slip of this benchmark by SciPy alone, and holds it against events.csv.

    python example.py

Needs NumPy and SciPy. It starts from the state after the last perturbation before the first stick (from the first row of
samples.csv where there is none), as errors of the long sliding before it die out, and stops where the disks stick for good.
"""

import csv
import json
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

here = Path(__file__).resolve().parent
p = {one["key"]: one["value"] for one in json.loads((here / "parameters.json").read_text(encoding="utf-8"))["parameters"]}
with open(here / "events.csv", newline="") as file:
    events = list(csv.DictReader(file))
with open(here / "samples.csv", newline="") as file:
    first = next(csv.DictReader(file))

m, c_a, k_e = p["axial.mass"], p["axial.damping"], p["axial.stiffness"]
if "torsion.stiffness" in p:
    inertia, J = p["torsion.rotor_inertia"], p["torsion.surface_inertia"]
    k_t, c_t = p["torsion.stiffness"], p["torsion.damping"]
else:
    (J, inertia), [k_t], [c_t] = p["rotor.inertia"], p["rotor.stiffness"], p["rotor.damping"]
r = p["contact.radius"]
mu_0, mu_s, mu_d = p["friction.breakaway"], p["friction.low_speed"], p["friction.high_speed"]
alpha = p["friction.decay"]
F_0, t_0 = p["actuation.force"], p["actuation.rise_time"]
NAMES = ("rotor_twist", "rotor_twist_rate", "phi1", "phi1_dot", "theta_dot", "z", "z_dot")


def torques(y):
    """T_r and T_s."""
    return c_t * y[1] + k_t * y[0], c_t * y[3] + k_t * y[2]


def limit(y):
    """mu_0 r F_n, and F_n."""
    normal = max(0.0, -c_a * y[6] - k_e * y[5])
    return mu_0 * r * normal, normal


def rates(t, y, s):
    """The equations of motion in slip of the sense s, in stick where it is 0."""
    T_r, T_s = torques(y)
    omega = y[4] - y[1] - y[3]
    slip = s * (mu_d + (mu_s - mu_d) * np.exp(-alpha * s * omega)) * r * limit(y)[1]
    T = slip if s else (T_r + T_s) / 2
    theta = -T_r / inertia
    force = F_0 * min(t / t_0, 1.0) if t_0 > 0 else F_0
    return [y[1], theta - (T_r - T) / J, y[3], (T - T_s) / J, theta, y[6], (-force - c_a * y[6] - k_e * y[5]) / m]


def slip_ends(t, y, s):
    return s * (y[4] - y[1] - y[3])


def stick_ends(t, y, s):
    return abs(sum(torques(y))) / 2 - limit(y)[0]


for event, direction in ((slip_ends, -1), (stick_ends, 1)):
    event.terminal, event.direction = True, direction

word = [row for row in events if row["kind"] in ("stick", "slip", "reversal")]
kicks = [row for row in events if row["kind"] == "kick" and word and float(row["time"]) < float(word[0]["time"])]
start, side = (kicks[-1], "_after") if kicks else (first, "")
t, y, s = float(start["time"]), np.array([float(start[name + side]) for name in NAMES]), 1
found, end = [], float(word[-1]["time"]) + 1e-3 if word else t
while t < end:
    step = 0.05 * 2 * np.pi * np.sqrt(J / k_t)
    run = solve_ivp(rates, (t, end), y, "DOP853", args=(s,), events=slip_ends if s else stick_ends, rtol=1e-12, atol=1e-15,
                    max_step=step)
    t, y = run.t[-1], run.y[:, -1]
    if run.status != 1:
        break
    held = (torques(y)[0] + torques(y)[1]) / 2
    if s:
        # Both surfaces take the mean of their speeds, and omega_r is exactly 0.
        half = (y[4] - y[1] - y[3]) / 2
        y[1], y[3] = y[1] + half, y[3] + half
        sticks = abs(held) <= limit(y)[0]
        found.append(("stick" if sticks else "reversal", t))
        s = 0 if sticks else int(np.sign(held))
    else:
        found.append(("slip", t))
        s = int(np.sign(held))

assert [kind for kind, _ in found] == [row["kind"] for row in word], "another sequence of events"
error = max((abs(t - float(row["time"])) for (_, t), row in zip(found, word)), default=0.0)
print(f"{len(found)} events, in the order of events.csv; the largest error of a time is {error:.1e} s")

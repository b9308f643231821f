"""What all adapters share: a problem read from its problem.json, its equations, and the writing of a submission.

The equations are written once, with + - * / and the functions of a namespace `lib` alone, so that NumPy, JAX, CasADi
and symbolic expressions may all go through them. Nothing here integrates anything.
"""
import argparse
import bisect
import json
import math
import pathlib
import sys
import time

TINY = 1e-14

# What a column of the set is in terms of the state, as a linear combination.
MEANING = {
    "engine_speed": {"speed1_0": 1}, "vehicle_speed": {"speed2_0": 1}, "engine_angle": {"angle1": 1},
    "vehicle_angle": {"angle2": 1}, "twist": {"twist1_0": 1}, "bit_speed": {"speed1_0": 1},
    "top_drive_speed": {"speed1_1": 1}, "hub_twist": {"twist1_0": 1}, "tyre_twist": {"twist1_1": 1},
    "caliper_angle": {"twist2_0": 1},
    "disc_speed": {"speed1_0": 1}, "wheel_speed": {"speed1_1": 1}, "caliper_speed": {"speed2_0": 1},
    "stretch": {"twist1_0": 1}, "rotor_twist": {"twist1_0": 1}, "rotor_twist_rate": {"speed1_1": 1, "speed1_0": -1},
    "stator_twist": {"twist2_0": 1}, "stator_twist_rate": {"speed2_0": 1}, "disk_speed": {"speed1_1": 1},
    "relative_velocity": {"speed1_0": 1, "speed2_0": -1}, "z_rate": {"axial_rate": 1},
}


class Unsupported(Exception):
    """Why a solver cannot state a problem, in a sentence."""


class Numbers:
    """The functions of the laws and signals for plain floats."""
    sin, cos, tanh, arctan = math.sin, math.cos, math.tanh, math.atan

    @staticmethod
    def exp(x):                             # a trial step may go far into speeds of the wrong sign
        return math.exp(min(x, 500.0))


def parts(signal):
    return [p for s in signal["of"] for p in parts(s)] if signal["kind"] == "sum" else [signal]


def value(signal, t):
    """A signal at a time, as a float."""
    total = 0.0
    for s in parts(signal):
        if s["kind"] == "constant":
            total += s["value"]
        elif s["kind"] == "harmonic":
            f = math.sin if s["shape"] == "sine" else math.cos
            total += s["mean"] + s["amplitude"] * f(s["angular_frequency"] * t + s["phase"])
        else:
            total += line(s, t)[0] + line(s, t)[1] * t
    return total


def line(s, t):
    """Intercept and slope of the piece of a piecewise linear signal that begins at t or holds there."""
    i = bisect.bisect_right(s["time"], t)
    if i == 0 or i == len(s["time"]):
        return s["value"][0 if i == 0 else -1], 0.0
    slope = (s["value"][i] - s["value"][i - 1]) / (s["time"][i] - s["time"][i - 1])
    return s["value"][i - 1] - slope * s["time"][i - 1], slope


def coefficient(law, x, lib=Numbers):
    """The coefficient of friction in slip at the speed x >= 0."""
    kind = law["law"]
    if kind == "coulomb":
        return law["kinetic"] + 0 * x
    if kind == "polynomial":
        return law["low_speed"] + x * (law["linear"] + x * (law["quadratic"] + x * law["cubic"]))
    low, high = law["low_speed"], law["high_speed"]
    if kind == "exponential":
        return high + (low - high) * lib.exp(-law["decay"] * x)
    if kind == "hyperbolic":
        return high + (low - high) / (1 + x / law["scale"])
    if kind in ("stribeck", "lugre"):
        r = x / law["scale"]
        fall = r * r if law["exponent"] == 2 else r ** law["exponent"]
        return high + (low - high) * lib.exp(-fall) + (law.get("viscous", 0.0) * x if kind == "stribeck" else 0.0)
    raise Unsupported(f"the law {kind} is unknown to these adapters")


class Problem:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.__dict__.update(json.loads((self.folder / "problem.json").read_text(encoding="utf-8")))
        s = self.system
        self.first, self.second, self.friction, self.radius = s["first"], s["second"], s["friction"], s["radius"]
        self.law, self.kicks = self.friction["law"], {k["time"]: k["relative_velocity"] for k in s["kicks"]}
        self.load, self.regularised = s["normal_force"], self.friction.get("regularisation")
        self.static = self.friction.get("static", self.friction.get("low_speed"))
        self.smooth = self.law == "lugre" or self.regularised is not None
        self.grid_times = []
        for g in self.grid:
            n = round((g["to"] - g["from"]) / g["step"])
            self.grid_times += [g["from"] + (g["to"] - g["from"]) * i / n for i in range(n + 1)]
        self.grid_times = sorted(set(self.grid_times))
        self._equations()

    def chains(self):
        """Number, sign in the relative velocity, chain, and its initial twists and speeds."""
        start = self.system["initial"]
        yield "1", 1, self.first, start["first_twist"], start["first_speed"]
        yield "2", -1, self.second, start["second_twist"], start["second_speed"]

    def _equations(self):
        """y' = A y + B u(t) + d T with the torque T of friction; v_rel = g y + g0."""
        self.state, self.y0, self.rows, self.inputs = [], [], {}, {}
        self.torque, self.gradient, self.g0 = {}, {}, 0.0
        for c, sign, chain, twists, speeds in self.chains():
            J, K, D = chain["inertia"], chain["stiffness"], chain["damping"]
            drive = chain.get("speed", {"kind": "constant", "value": 0.0})
            if not J:                       # the surface is itself the end
                if drive["kind"] != "constant":
                    raise Unsupported("a driven surface whose speed varies is not written in these adapters")
                self.g0 += sign * drive["value"]
                continue
            for i, w in enumerate(speeds):
                self._add(f"speed{c}_{i}", w, {f"speed{c}_{i}": -chain["viscous"][i] / J[i]})
            if "force" in chain:
                self.inputs[f"speed{c}_{chain['force_on']}"] = [(1 / J[chain["force_on"]], chain["force"])]
            for i, u in enumerate(twists):
                inner, outer, tw = f"speed{c}_{i}", f"speed{c}_{i + 1}", f"twist{c}_{i}"
                self._add(tw, u, {inner: -sign, **({outer: sign} if i + 1 < len(J) else {})})
                rate = dict(self.rows[tw])
                if i + 1 == len(J):         # the end of the chain: fixed, or driven
                    self.inputs.setdefault(tw, []).append((sign, drive))
                for k, way in [(i, sign)] + ([(i + 1, -sign)] if i + 1 < len(J) else []):
                    row = self.rows[f"speed{c}_{k}"]
                    for n, a in [(tw, K[i])] + [(n, D[i] * b) for n, b in rate.items()]:
                        row[n] = row.get(n, 0.0) + way * a / J[k]
                    if i + 1 == len(J) and D[i]:
                        self.inputs.setdefault(f"speed{c}_{k}", []).append((way * D[i] * sign / J[k], drive))
            if not K:
                self._add(f"angle{c}", 0.0, {f"speed{c}_0": 1.0})
            self.torque[f"speed{c}_0"], self.gradient[f"speed{c}_0"] = -sign / J[0], sign
        if self.load["kind"] == "axial":
            a = self.load
            self._add("z", 0.0, {"axial_rate": 1.0})
            self._add("axial_rate", 0.0, {"z": -a["stiffness"] / a["mass"], "axial_rate": -a["damping"] / a["mass"]})
            self.inputs["axial_rate"] = [(-1 / a["mass"], a["force"])]
        if self.law == "lugre":
            self._add("bristle", 0.0, {})
        at = self.at = {n: i for i, n in enumerate(self.state)}
        self.table = [([(at[n], a) for n, a in self.rows[q].items() if a],
                       [(b, p) for b, s in self.inputs.get(q, []) for p in parts(s)
                        if p["kind"] != "constant" or p["value"]]) for q in self.state]
        self.d = {at[n]: x for n, x in self.torque.items()}
        self.g = {at[n]: x for n, x in self.gradient.items()}
        self.compliance = -sum(self.d[i] * x for i, x in self.g.items())
        self.loads = parts(self.load) if self.load["kind"] != "axial" else []
        used = [s for _, inputs in self.table for _, s in inputs] + self.loads
        self.lines = [s for s in used if s["kind"] == "linear"]
        self.place = {id(s): 1 + 2 * i for i, s in enumerate(self.lines)}
        self.corners = sorted({t for s in self.lines for t in s["time"] if 0 < t < self.end_time} | set(self.kicks))
        bare = {"x": {"twist2_0": 1} if "twist2_0" in at else {"angle1": 1}, "v": {n: 1 for n in self.gradient},
                "z": {"bristle": 1} if self.law == "lugre" else {"z": 1}}
        self.out = [[(at[n], a) for n, a in {**MEANING, **bare}[c["name"]].items()] for c in self.columns]

    def _add(self, name, start, row):
        self.state.append(name)
        self.y0.append(float(start))
        self.rows[name] = row

    # The right-hand sides. p = [s, intercept and slope of every piecewise linear signal]: constant in a piece of a run.
    def parameters(self, t, s=0.0):
        return [float(s)] + [float(x) for q in self.lines for x in line(q, t)]

    def _signal(self, s, t, p, lib):
        if s["kind"] == "constant":
            return s["value"]
        if s["kind"] == "linear":
            i = self.place[id(s)]
            return p[i] + p[i + 1] * t
        f = lib.sin if s["shape"] == "sine" else lib.cos
        return s["mean"] + s["amplitude"] * f(s["angular_frequency"] * t + s["phase"])

    def slip_speed(self, y):
        v = self.g0
        for i, x in self.g.items():
            v = v + x * y[i]
        return v

    def normal_force(self, t, y, p, lib=Numbers):
        if self.load["kind"] == "axial":
            return -self.load["stiffness"] * y[self.at["z"]] - self.load["damping"] * y[self.at["axial_rate"]]
        load = 0.0
        for s in self.loads:
            load = load + self._signal(s, t, p, lib)
        return load

    def free(self, t, y, p, lib=Numbers):
        """The derivative of the state without friction."""
        f = []
        for row, inputs in self.table:
            total = 0.0
            for j, a in row:
                total = total + a * y[j]
            for b, s in inputs:
                total = total + b * self._signal(s, t, p, lib)
            f.append(total)
        return f

    def holding(self, t, y, p, lib=Numbers):
        """The torque that keeps the relative velocity as it is: the constraint's in stick."""
        f = self.free(t, y, p, lib)
        return sum(x * f[i] for i, x in self.g.items()) / self.compliance

    def limit(self, t, y, p, lib=Numbers):
        """The largest torque of friction at rest."""
        return self.static * self.radius * self.normal_force(t, y, p, lib)

    def rate(self, mode, t, y, p, lib=Numbers):
        """The derivative of the state in the mode slip, stick, open or smooth; p[0] is the sign of v_rel."""
        f = self.free(t, y, p, lib)
        if mode == "open":
            return f
        if mode == "stick":
            torque = sum(x * f[i] for i, x in self.g.items()) / self.compliance
        else:
            v, load = self.slip_speed(y), self.radius * self.normal_force(t, y, p, lib)
            torque = p[0] * load * coefficient(self.friction, p[0] * v, lib)
            if self.regularised:
                r = v / self.regularised["speed"]
                shape = lib.tanh(r) if self.regularised["function"] == "tanh" else 2 / math.pi * lib.arctan(r)
                torque = p[0] * torque * shape
            elif self.law == "lugre":
                z, q = y[-1], self.friction
                f[-1] = v - q["bristle_stiffness"] * p[0] * v * z / coefficient(q, p[0] * v, lib)
                torque = load * (q["bristle_stiffness"] * z + q["bristle_damping"] * f[-1] + q["viscous"] * v)
        for i, x in self.d.items():
            f[i] = f[i] + x * torque
        return f

    def from_bodies(self, at):
        """The state from name -> (place, speed) of the inertias, and of driven ends as end1 or end2."""
        def one(name):
            if name in at:
                return at[name][1]
            c, i = name[5], int(name[7:] or 0)
            inner = at[f"speed{c}_{i}"][0]
            outer = at.get(f"speed{c}_{i + 1}", at.get("end" + c, (0.0, 0.0)))[0]
            return inner if name.startswith("angle") else outer - inner if c == "1" else inner - outer
        return [one(name) for name in self.state]

    def dense_times(self):
        """The times of the grid, and between them as many as the motion needs wherever the grid itself resolves it."""
        times, per = set(self.grid_times) | {0.0, self.end_time}, 4000 if self.smooth else 1000
        for g in self.grid:
            if g["step"] <= self.time_scale:
                count = math.ceil(g["step"] * per / self.time_scale) * round((g["to"] - g["from"]) / g["step"])
                count = min(count, 50000)
                times |= {g["from"] + (g["to"] - g["from"]) * i / count for i in range(count)}
        return sorted(t for t in times if t <= self.end_time)

    def opens(self):
        """Whether the contact opens, as far as the load is a signal."""
        return self.load["kind"] != "axial" and any(value(self.load, t) < 0 for t in self.grid_times)

    def row(self, y):
        return [sum(a * y[i] for i, a in o) for o in self.out]

    def mass(self):
        """The single mass that simulators of bodies know, or the reason why this problem is none."""
        one, other = (self.first, self.second) if self.first["inertia"] else (self.second, self.first)
        if other["inertia"] or len(one["inertia"]) != 1 or self.load["kind"] == "axial":
            raise Unsupported("this adapter states a single mass, not chains of inertias")
        if self.law == "lugre":
            raise Unsupported("no friction law with bristles")
        return Mass(self, one, 1 if one is self.first else -1)


class Mass:
    """m x'' = force(t) - k x - c x' + friction against a belt; v_rel = sign (x' - belt)."""
    def __init__(self, problem, chain, sign):
        self.m, self.sign = chain["inertia"][0], sign
        self.force = chain.get("force", {"kind": "constant", "value": 0.0})
        self.k, self.c = (chain["stiffness"] or [0.0])[0], (chain["damping"] or [0.0])[0] + chain["viscous"][0]
        self.belt, self.load, self.problem = -sign * problem.g0, problem.load, problem
        self.x0, self.v0 = problem.row(problem.y0)
        self.end_time = problem.end_time
        self.kicks = {t: sign * dv for t, dv in problem.kicks.items()}

    def applied(self, t, x, v):
        """All forces on the mass but friction."""
        return value(self.force, t) - self.k * x - self.c * v

    def limit(self, t, speed, rest):
        """The largest force of friction, at rest up to the speed `rest`: for codes that take a number each step."""
        q, speed = self.problem.friction, abs(speed)
        mu = self.problem.static if speed <= rest else coefficient(q, speed)
        return mu * max(0.0, value(self.load, t))

    def stepped(self, dt, step, most=50000):
        """Rows of a run with equal steps; step(t, dv) makes one, after a jump dv, and returns position and speed."""
        count = round(self.problem.end_time / dt)
        every, rows, kicks = -(-count // most), [[0.0, self.x0, self.v0]], sorted(self.kicks.items())
        for i in range(count):
            jump = 0.0
            while kicks and kicks[0][0] <= (i + 0.5) * dt:
                jump += kicks.pop(0)[1]
            x, v = step(i * dt, jump)
            if (i + 1) % every == 0:
                rows.append([(i + 1) * dt, x, v])
        return rows

    def constant_load(self, varying=None):
        """The weight of the mass, where the normal force is constant."""
        if self.load["kind"] != "constant":
            raise Unsupported(varying or "the normal force is the weight, which does not vary")
        return self.load["value"]

    def one_coefficient(self):
        q = self.problem.friction
        if self.problem.smooth or q["law"] != "coulomb" or q["static"] != q["kinetic"]:
            raise Unsupported("one coefficient of friction: no static one above the kinetic, and no law of the speed")
        return q["kinetic"]

    def two_coefficients(self):
        q = self.problem.friction
        if self.problem.smooth or q["law"] != "coulomb":
            raise Unsupported("no friction law beyond Coulomb")
        return q["static"], q["kinetic"]


def main(solve, solver, version, settings, compiles=False):
    """The command line of an adapter.

    solve(problem, options) returns rows [time, columns...] and events [(time, kind)], or None for these; settings has
    options by name. A run is timed twice, so that the second one is without compilation; one that takes long, and
    compiles nothing, is run once.
    """
    arguments = argparse.ArgumentParser(description=solver)
    arguments.add_argument("folder")
    arguments.add_argument("output")
    arguments.add_argument("--setting", default=next(iter(settings)), choices=settings)
    a = arguments.parse_args()
    options, problem = settings[a.setting], Problem(a.folder)
    try:
        start = time.perf_counter()
        rows, events = solve(problem, options)
        first = again = time.perf_counter() - start
        if first < (60 if compiles else 5):
            start = time.perf_counter()
            rows, events = solve(problem, options)
            again = time.perf_counter() - start
    except Unsupported as reason:
        print(f"unsupported: {reason}")
        sys.exit(3)
    said = ", ".join(f"{k} {v}" for k, v in options.items() if k != "threshold")
    head = f"# solver: {solver}\n# version: {version}\n# settings: {a.setting}" + (f": {said}\n" if said else "\n")
    head += f"# seconds: first={first:.6g} again={again:.6g}\n"
    with open(a.output, "w", encoding="utf-8") as out:
        out.write(head + (f"# threshold: {options['threshold']:g}\n" if "threshold" in options else ""))
        out.write(",".join(["time"] + [c["name"] for c in problem.columns]) + "\n")
        out.writelines(",".join(repr(float(x)) for x in r) + "\n" for r in rows)
    if events is not None:
        with open(a.output[:-4] + ".events.csv", "w", encoding="utf-8") as out:
            out.write(head + "time,kind\n" + "".join(f"{float(t)!r},{k}\n" for t, k in events))

"""Exudyn: masses on coordinates, with the friction of CoordinateSpringDamperExt.

class: regularised
table: bristle zone
figure: narrow
bristle: sticking by a stiff spring-damper, with a switch after each step; zone: friction proportional to the speed
near zero. A static coefficient above the kinetic one falls within a speed of 1e-4. A belt, or a driven end, is a very
heavy mass. The generalised alpha method as it comes, with equal steps.
"""
import math

import exudyn
import exudyn.itemInterface as item

import problem as shared

# step: in parts of the time scale; sticking: frequency of the mass on the bristles, times the step
SETTINGS = {"bristle": {"step": 1e-4, "sticking": 0.3, "zone": 0.0, "threshold": 1e-3},
            "zone": {"step": 1e-4, "sticking": 0.0, "zone": 1e-4, "threshold": 1e-4},
            "narrow": {"step": 2e-5, "sticking": 0.0, "zone": 1e-5, "threshold": 1e-5}}
HEAVY = 1e12


def solve(problem, options):
    q, h, axial = problem.friction, options["step"] * problem.time_scale, problem.load["kind"] == "axial"
    if problem.smooth or axial or q["law"] not in ("coulomb", "exponential") or q["static"] > q.get("low_speed", 1e9):
        raise shared.Unsupported("friction falls with the speed in one exponential, and its limit is no state")
    kinetic, decay = (q["kinetic"], 1e-4) if q["law"] == "coulomb" else (q["high_speed"], 1 / q["decay"])
    mbs = exudyn.SystemContainer().AddSystem()
    ground = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    nodes, markers = {}, {}

    def mass(name, inertia, x, v):
        nodes[name] = mbs.AddNode(item.Node1D(initialCoordinates=[x], initialVelocities=[v]))
        mbs.AddObject(item.ObjectMass1D(physicsMass=inertia, nodeNumber=nodes[name]))
        markers[name] = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[name], coordinate=0))
        return markers[name]

    surfaces, places = [], []
    for c, sign, chain, twists, speeds in problem.chains():
        count, place, outer = len(chain["inertia"]), 0.0, ground
        if chain["end"] == "driven":
            outer = mass("end" + c, HEAVY, 0.0, shared.value(chain["speed"], 0.0))
        for i in reversed(range(count)):
            place -= sign * twists[i] if i < len(twists) else 0.0
            inner = mass(f"speed{c}_{i}", chain["inertia"][i], place, speeds[i])
            if i < len(twists):
                mbs.AddObject(item.CoordinateSpringDamper(
                    markerNumbers=[outer, inner], stiffness=chain["stiffness"][i], damping=chain["damping"][i]))
            mbs.AddObject(item.CoordinateSpringDamper(markerNumbers=[ground, inner], damping=chain["viscous"][i]))
            outer = inner
        surfaces, places = surfaces + [outer], places + [place]
        if "force" in chain:
            mbs.AddLoad(item.LoadCoordinate(
                markerNumber=markers[f"speed{c}_{chain['force_on']}"],
                loadUserFunction=lambda mbs, t, load, force=chain["force"]: shared.value(force, t)))
    # friction mode (the force of slip with its sign, 0 in stick), last position of stick, limit stop
    v, load = problem.slip_speed(problem.y0), problem.radius * shared.value(problem.load, 0.0)
    bristles = mbs.AddNode(item.NodeGenericData(numberOfDataCoordinates=3, initialCoordinates=[
        math.copysign(kinetic * load, v) if v else 0.0, places[0] - places[1], 0.0]))
    stiffness = (options["sticking"] / h) ** 2 / problem.compliance
    contact = mbs.AddObject(item.CoordinateSpringDamperExt(
        markerNumbers=surfaces[::-1], nodeNumber=bristles, exponentialDecayStatic=decay, stickingStiffness=stiffness,
        stickingDamping=2 * (stiffness / problem.compliance) ** 0.5, frictionProportionalZone=options["zone"]))

    def limits(mbs, t):
        limit = problem.radius * max(1e-9, shared.value(problem.load, t))     # never 0: that switches it off
        mbs.SetObjectParameter(contact, "dynamicFrictionForce", kinetic * limit)
        mbs.SetObjectParameter(contact, "staticFrictionOffsetForce", (q["static"] - kinetic) * limit)
        return True

    limits(mbs, 0.0)
    mbs.SetPreStepUserFunction(limits if problem.load["kind"] != "constant" else 0)
    kind, data = exudyn.OutputVariableType, exudyn.ConfigurationType
    sensors = [[mbs.AddSensor(item.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=k))
                for node in nodes.values()] for k in (kind.Coordinates, kind.Coordinates_t)]
    mbs.Assemble()
    settings, rows, names = exudyn.SimulationSettings(), [], list(nodes)
    settings.timeIntegration.discontinuous.iterationTolerance = 1e-3
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = max(1, round(problem.end_time / h / 100000)) * h
    edges = [0.0] + sorted(problem.kicks) + [problem.end_time]
    for start, end in zip(edges, edges[1:]):
        settings.timeIntegration.startTime, settings.timeIntegration.endTime = start, end
        settings.timeIntegration.numberOfSteps = round((end - start) / h)
        mbs.SolveDynamic(settings)
        x, v = ([mbs.GetSensorStoredData(s) for s in group] for group in sensors)
        for k, t in enumerate(x[0][:, 0].tolist()):
            at = {n: (x[i][k, 1], v[i][k, 1]) for i, n in enumerate(names)}
            rows.append([t] + problem.row(problem.from_bodies(at)))
        mbs.systemData.SetSystemState(mbs.systemData.GetSystemState(data.Current), data.Initial)
        speeds = mbs.systemData.GetODE2Coordinates_t(data.Initial)
        for j, share in problem.d.items():
            speeds[names.index(problem.state[j])] -= share * problem.kicks.get(end, 0.0) / problem.compliance
        mbs.systemData.SetODE2Coordinates_t(speeds, data.Initial)
    return rows, None


if __name__ == "__main__":
    shared.main(solve, "Exudyn", exudyn.__version__, SETTINGS)

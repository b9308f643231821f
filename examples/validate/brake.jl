# The stick-slip of a brake with an explicit Runge-Kutta method of one's own and located events, in Julia without packages.
#
#     stickslip run paper-si
#     stickslip export paper-si.h5 --table events -o events.csv
#     julia examples/validate/brake.jl events.csv julia.csv
#     stickslip compare paper-si.h5 julia.csv
#
# The same as brake.m: the state is [u, u', v, v', theta'], rotor twist u = theta - phi_2, stator twist v = phi_1, rotor speed.
# The run begins at the kick, with the state of the reference, and takes steps of a microsecond of the Dormand-Prince pair's
# order 5. A step in which a guard changes its sign is repeated with the length that brings the guard to zero.

const I, J, K, C = 2.262, 0.0113, 7.71e6, 22.606        # of the case paper-si, SI
const RF = 0.052388 * 2225.0
const BREAKAWAY, LOW, HIGH, DECAY = 0.6, 0.6, 0.3, 3.5
const STOP, STEP = 6.99, 1e-6                           # s

"Time and state just after the kick, from the table of events."
function start(path)
    lines = readlines(path)
    names = [first(split(name, " [")) for name in split(lines[1], ",")]
    column(name) = findfirst(==(name), names)
    rows = [split(line, ",") for line in lines[2:end]]
    row = rows[findfirst(row -> row[column("kind")] in ("kick", "5"), rows)]
    number(name) = parse(Float64, row[column(name)])
    state = ["rotor_twist_after", "rotor_twist_rate_after", "phi1_after", "phi1_dot_after", "theta_dot_after"]
    return number("time"), number.(state)
end

"omega_r = phi_2' - phi_1'"
relative(y) = y[5] - y[2] - y[4]

"T_f = (T_r + T_s)/2, what the interface carries in stick"
transmitted(y) = (C * (y[2] + y[4]) + K * (y[1] + y[3])) / 2

"Positive as long as the mode lasts; the mode is the sense of the slip, 0 in stick."
guard(sense, y) = sense == 0 ? BREAKAWAY * RF - abs(transmitted(y)) : sense * relative(y)

"Equations (2) and (3), in stick (4)"
function rates(sense, y)
    rotor = C * y[2] + K * y[1]
    stator = C * y[4] + K * y[3]
    theta = -rotor / I
    if sense == 0
        phi1 = phi2 = (rotor - stator) / 2J
    else
        friction = sense * RF * (HIGH + (LOW - HIGH) * exp(-DECAY * sense * relative(y)))
        phi2 = (rotor - friction) / J
        phi1 = (friction - stator) / J
    end
    return [y[2], theta - phi2, y[4], phi1, theta]
end

"One step of Dormand and Prince, order 5"
function runge_kutta(sense, y, h)
    f(y) = rates(sense, y)
    k1 = f(y)
    k2 = f(y + h * (k1 / 5))
    k3 = f(y + h * (k1 * (3 / 40) + k2 * (9 / 40)))
    k4 = f(y + h * (k1 * (44 / 45) - k2 * (56 / 15) + k3 * (32 / 9)))
    k5 = f(y + h * (k1 * (19372 / 6561) - k2 * (25360 / 2187) + k3 * (64448 / 6561) - k4 * (212 / 729)))
    k6 = f(y + h * (k1 * (9017 / 3168) - k2 * (355 / 33) + k3 * (46732 / 5247) + k4 * (49 / 176) - k5 * (5103 / 18656)))
    return y + h * (k1 * (35 / 384) + k3 * (500 / 1113) + k4 * (125 / 192) - k5 * (2187 / 6784) + k6 * (11 / 84))
end

"The step at whose end the guard is zero: false position, as Illinois has it"
function locate(sense, y, h)
    low, high = 0.0, h
    g_low, g_high = guard(sense, y), guard(sense, runge_kutta(sense, y, h))
    for _ in 1:50
        h = high - g_high * (high - low) / (g_high - g_low)
        g = guard(sense, runge_kutta(sense, y, h))
        if g == 0 || high - low < 1e-18
            break
        elseif g < 0
            high, g_high, g_low = h, g, g_low / 2
        else
            low, g_low, g_high = h, g, g_high / 2
        end
    end
    return h
end

function main(events, output)
    t, y = start(events)
    sense = 1.0
    samples, changes = [(t, y..., relative(y))], 0
    while t < STOP
        h = STEP
        new = runge_kutta(sense, y, h)
        fired = guard(sense, new) < 0
        if fired && guard(sense, y) > 0
            h = locate(sense, y, h)
            new = runge_kutta(sense, y, h)
        end
        t, y = t + h, new
        if fired
            torque = transmitted(y)
            if sense != 0                               # the surfaces meet at their mean speed
                y[[2, 4]] .+= relative(y) / 2
            end
            joins = sense != 0 && abs(torque) <= BREAKAWAY * RF
            sense = joins ? 0.0 : sign(torque)
            changes += 1
        end
        push!(samples, (t, y..., sense == 0 || fired ? 0.0 : relative(y)))
    end
    open(output, "w") do file
        println(file, "time,rotor_twist,rotor_twist_rate,phi1,phi1_dot,theta_dot,relative_velocity")
        foreach(row -> println(file, join(row, ",")), samples)
    end
    println("$output: $(length(samples)) samples, $changes changes between stick and slip")
end

main(ARGS...)
